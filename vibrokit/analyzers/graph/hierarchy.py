"""GridHierarchy: one potential on finer and coarser grids and with longer steps, whose differences give the error."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from functools import cached_property

import numpy as np

from vibrokit.analyzers.graph.coverage import Coverage
from vibrokit.analyzers.graph.targets import ExitTarget
from vibrokit.analyzers.graph.tracing import SolvedGrid, TracedPath, distinct
from vibrokit.analyzers.paths.candidate import Candidate

PATH_FACTOR = 2.0
"""Factor on the difference from a path's action: the path's fixed ends make that an upper bound."""
_STEP_FACTOR = 0.5  # of the change by doubling the step: the error falls at least with the square of the step


@dataclasses.dataclass(frozen=True, eq=False)
class TargetEstimate:
    """What reaching an exit target costs."""

    value: float
    error: float  # both are infinite if the target was not reached
    by_nodes: float  # part of the error that the nodes alone show
    unsettled: float  # the part of the value by which more sweeps may change it
    steps: int  # in a section interval
    known: float  # least action of the paths there that were known before; infinite for none
    paths: tuple[TracedPath, ...]  # distinct ones, the cheapest first

    @property
    def candidates(self) -> tuple[Candidate, ...]:
        """The paths as guesses for polishing; their last states lie beyond the exit."""
        return tuple(path.candidate for path in self.paths)


@dataclasses.dataclass(frozen=True, eq=False)
class GridHierarchy:
    """The potential on the nodes that were asked for, and on half as many along each side."""

    coverage: Coverage
    fine: SolvedGrid
    coarse: SolvedGrid  # half as many nodes on what can be reached for little more than the costliest exit
    whole: SolvedGrid  # as few on all that the region covers, or fewer
    lengthened: Callable[[], SolvedGrid]  # solves the coarse grid with steps twice as long

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
        no path was traced, half the change by doubling the step), that of the target's own place, and what more sweeps
        may change.
        """
        by_nodes, unsettled = np.inf, self.fine.potential.unsettled
        fine, coarse = self._value(self.fine, target), self._value(self.coarse, target)
        grids = (self.fine, self.coarse) if np.isfinite(fine) else (self.whole,)
        reached = (grid for grid in grids if np.isfinite(self._value(grid, target)))
        paths = distinct(path for grid in reached for path in grid.paths(target))
        by_step = np.inf
        if np.isfinite([fine, coarse]).all():
            by_step = (
                PATH_FACTOR * abs(paths[0].candidate.action - fine)
                if paths
                else _STEP_FACTOR * abs(coarse - self._value(self.long, target))
            )
        if np.isfinite(by_step):
            by_nodes = abs(fine - coarse) + self.fine.arrival(target).error + unsettled * fine
            value, error = fine, by_nodes + by_step
        else:
            value = error = self._value(self.whole, target)
        known = min((path.value for path in self.coverage.branches if path.target in target.labels), default=np.inf)
        return TargetEstimate(value, error, by_nodes, unsettled, self.fine.steps, known, tuple(paths))

    def _value(self, grid: SolvedGrid, target: ExitTarget) -> float:
        """V at a target; infinite where it is not reached."""
        return grid.arrival(target).value if target in self.coverage.reached(grid) else np.inf
