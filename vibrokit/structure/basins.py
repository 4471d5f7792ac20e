"""Basins on a grid: where each cell of the region leads."""

from __future__ import annotations

import concurrent.futures
import dataclasses

import numpy as np
from numpy.typing import NDArray

from vibrokit.kernels.ensemble import Progress, Stop, run_ensemble
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.stopping import REACHED
from vibrokit.oscillator import Oscillator
from vibrokit.structure.region import Region
from vibrokit.symbolic.flow_kind import Flow

UNSETTLED = -1
"""Label of cells that reached no attractor in the time given, or ran out of range."""


@dataclasses.dataclass(frozen=True, eq=False)
class Basins:
    """Labels of the cells of a region.

    Attributes
    ----------
    region : Region
    labels : int16 array (nx, nv)
        Label of the attractor that each cell's centre leads to; UNSETTLED where none was reached.
    """

    region: Region
    labels: NDArray[np.int16]

    def fraction(self, label: int) -> float:
        """Share of the cells with a label."""
        return float(np.mean(self.labels == label))

    def stop(self, home: int) -> Stop:
        """Return the test that ends a trajectory when it leaves the basin `home`, or the region."""
        return Stop(region=self.region.bounds, labels=self.labels, home=home)


def settle(
    osc: Oscillator,
    states: NDArray[np.float64],
    points: list[NDArray[np.float64]],
    *,
    tolerance: float,
    budget: int,
    stepper: Stepper,
    executor: concurrent.futures.Executor | None = None,
    progress: Progress | None = None,
) -> NDArray[np.int64]:
    """Return the label of the attractor that each state settles on, UNSETTLED where it settles on none in time.

    Parameters
    ----------
    osc : Oscillator
    states : array (count, n)
    points : list of array (period, n)
        Points of each attractor on the section.
    tolerance : float
        Distance in x and in v at which an attractor counts as reached.
    budget : int
        Most periods to wait.
    stepper : Stepper
    """
    stop = Stop(
        points=np.ascontiguousarray(np.concatenate(points)[:, :2]),
        point_labels=np.repeat(np.arange(len(points)), [len(orbit) for orbit in points]),
        tolerance=tolerance,
    )
    ended = run_ensemble(osc, Flow.STATE, stepper, states, budget, stop=stop, executor=executor, progress=progress)
    return np.where(ended.status == REACHED, ended.label, UNSETTLED)
