"""GridHierarchy: one potential on finer and coarser grids and with longer steps, whose differences give the error."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from functools import cached_property

import numpy as np

from vibrokit.analyzers.graph.targets import ExitTarget
from vibrokit.analyzers.graph.tracing import SolvedGrid, distinct
from vibrokit.analyzers.paths.candidate import Candidate

PATH_FACTOR = 2.0
"""Factor on the difference from a path's action: the path's fixed ends make that an upper bound."""
_STEP_FACTOR = 0.5  # of the change by doubling the step: the error falls at least with the square of the step
_FEWEST_NODES = 16  # along a side of the coarse grids
# Along a side of a grid that says what to cover: 45 covered too much around the chaotic attractor of hertz-0.525, where
# linearized steps made V ten times too small.
_FEWEST_RELIABLE = 64

Shape = tuple[int, int]
"""Nodes in x and in v."""


@dataclasses.dataclass(frozen=True, eq=False)
class TargetEstimate:
    """What reaching an exit target costs."""

    value: float
    error: float  # both are infinite if the target was not reached
    by_nodes: float  # part of the error that the nodes alone show
    candidates: tuple[Candidate, ...]  # distinct paths, the cheapest first; their last states lie beyond the exit


@dataclasses.dataclass(frozen=True, eq=False)
class GridHierarchy:
    """The potential on the nodes that were asked for, and on half as many along each side."""

    fine: SolvedGrid
    coarse: SolvedGrid  # half as many nodes on what can be reached for little more than the costliest exit
    whole: SolvedGrid  # as few on all that the region covers, or fewer
    lengthened: Callable[[], SolvedGrid]  # solves the coarse grid with steps twice as long

    def refined_by(self, shape: Shape) -> bool:
        """Whether one with so many nodes can go on from the fine grid: twice as many, on boxes that are reliable."""
        grids = self.coarse.potential.grids
        return self.fine.potential.grids.shape == halved(shape) and min(grids.shape) >= _FEWEST_RELIABLE

    @property
    def intervals(self) -> int:
        """Section intervals that have grids of their own."""
        return self.fine.intervals

    @cached_property
    def long(self) -> SolvedGrid:
        """The coarse grid with steps twice as long."""
        return self.lengthened()

    def estimate(self, target: ExitTarget) -> TargetEstimate:
        """Return what an exit target costs.

        The error is the change by halving the nodes, the difference from a path's action by Hamilton's equations (if
        no path was traced, half the change by doubling the step), and that of the target's own place.
        """
        arrival, by_nodes = self.fine.arrival(target), np.inf
        fine, coarse = arrival.value, self.coarse.arrival(target).value
        reached = (self.fine, self.coarse) if np.isfinite(fine) else (self.whole,)
        paths = distinct(path for grid in reached for path in grid.paths(target))
        by_step = np.inf
        if np.isfinite([fine, coarse]).all():
            by_step = (
                PATH_FACTOR * abs(paths[0].candidate.action - fine)
                if paths
                else _STEP_FACTOR * abs(coarse - self.long.arrival(target).value)
            )
        if np.isfinite(by_step):
            by_nodes = abs(fine - coarse) + arrival.error
            value, error = fine, by_nodes + by_step
        else:
            value = error = self.whole.arrival(target).value
        return TargetEstimate(value, error, by_nodes, tuple(path.candidate for path in paths))


def halved(shape: Shape) -> Shape:
    """Return half as many nodes along each side, but not very few."""
    return max(_FEWEST_NODES, shape[0] // 2), max(_FEWEST_NODES, shape[1] // 2)
