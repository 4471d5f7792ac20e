"""Arrival: the test for having reached a known orbit."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from vibrokit.kernels.ensemble import Stop


def arrival_at(orbits: Mapping[int, NDArray[np.float64]], tolerance: float) -> Stop:
    """Return the test that ends a trajectory at an orbit.

    Parameters
    ----------
    orbits : mapping of int to array (period, n)
        By label, the points of each on the section; may be empty.
    tolerance : float
        Distance in (x, v) at which an orbit counts as reached.
    """
    points = np.concatenate([np.empty((0, 2)), *(points[:, :2] for points in orbits.values())])
    labels = np.repeat(list(orbits), [len(points) for points in orbits.values()])
    return Stop(points=points, point_labels=labels.astype(np.int64), tolerance=tolerance)
