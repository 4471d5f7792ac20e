"""Linearize Hamilton's equations along any closed orbit."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.polishing.linearized_at_nodes import orbit_at_nodes
from vibrokit.analyzers.polishing.linearized_cycle import linearized_cycle
from vibrokit.analyzers.polishing.linearized_orbit import LinearizedOrbit

Array = NDArray[np.float64]


def linearized_orbit(propagator: SegmentPropagator, point: Array, period: int, duration: float) -> LinearizedOrbit:
    """Linearize Hamilton's equations along an orbit, an equilibrium, or a limit cycle, of any stability.

    Parameters
    ----------
    propagator : SegmentPropagator
    point : array (n,)
        One of its points on the section; it is refined.
    period : int
        In section intervals; 0 and 1 are the same.
    duration : float
        Time after which it repeats (s); 0 for an equilibrium.

    Raises
    ------
    StructureError
        There is no such orbit near the point, or it is not hyperbolic.
    """
    if propagator.osc.autonomous and duration > 0:
        return linearized_cycle(propagator, point, duration)
    return orbit_at_nodes(propagator, point, max(1, period))
