"""ValueIteration: the quasi-potential away from the attractor, by sweeps over the phases."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from vibrokit.analyzers.graph.grids import Grids
from vibrokit.analyzers.graph.potential import Potential
from vibrokit.analyzers.graph.seeds import seeds
from vibrokit.analyzers.graph.step_model import StepModel
from vibrokit.kernels.sweeps import evaluate_rows, sweep_rows
from vibrokit.kernels.tasks import carry
from vibrokit.progress import advance
from vibrokit.results.attractor import Attractor

_ROWS = 16  # of one task; fixed, so that the result is the same on any number of processors
_ROWS_EVALUATED = 64  # of one task that only evaluates V
_NEIGHBOURHOOD = 7  # nodes across in which a change is felt: interpolation reaches 2 to each side, predecessors move 1
_TOLERANCE = 1e-5  # relative change of V that is not passed on; far below the error of interpolation
_REACH = 8  # nodes to each side among which a sweep looks for cheaper predecessors
_CYCLE = 4  # periods from one wide search for predecessors, and one test of convergence, to the next
# Cycles in which every period improves the predecessors; later only the first of a cycle does. On ten scenes that took
# half to four fifths of the time, and V was the same within a tenth of its error.
_IMPROVING = 3
_WIDE_SEARCHES = 4  # each evaluates up to (2 · 8 + 1)² nodes for every node, many times what following costs
_CONVERGED = 2e-5  # relative change of the mean of √V over a cycle; 10 times less changes V by at most 0.1 %
_MOST_PERIODS = 400
# V goes round if its range over 5 cycles is more than 4 times the drift of its mean from the 5 cycles before; where it
# converges from one side, the ratio is at most 1. In a stiff contact V may go round by 1e-4 to 1e-3 for ever.
_ROUND, _DRIFT = 5, 4.0

Array = NDArray[np.float64]
Flags = NDArray[np.uint8]
Mask = NDArray[np.bool_]


class ValueIteration:
    """Value iteration on some grids; raises StructureError if the attractor is not hyperbolic.

    V is computed at the nodes (nx, nv) of each phase that are wanted, by default at all; elsewhere it is the ceiling.
    """

    def __init__(
        self, model: StepModel, attractor: Attractor, grids: Grids, wanted: Sequence[Mask] | None = None
    ) -> None:
        self.grids = grids
        self.sweeps = max(grids.phases, grids.steps)  # over all phases, or a section interval
        known = seeds(model, attractor, grids)
        self.orbit = known.orbit
        self.fixed = [np.isfinite(values) for values in known.values]
        self.bounds = [np.full(grids.shape, np.inf) for _ in known.values]  # of V: costs of one step from the orbit
        self.centres, self.roots, self.predecessors, self.uphill = [], [], [], []
        last = np.array(grids.shape) - 2.0
        for phase in range(grids.phases):
            after = (phase + 1) % grids.phases
            kept = np.ones(grids.shape, dtype=bool) if wanted is None else wanted[after]
            costs = model.into(grids.nodes(after)[kept], grids, phase)
            for visit in grids.index(phase, known.orbit[phase :: grids.phases]):
                np.fmin(self.bounds[after], _on_nodes(costs.cost(visit), kept), out=self.bounds[after])
            self.centres.append(_on_nodes(costs.centres, kept))
            self.roots.append(_on_nodes(costs.roots, kept))
            self.predecessors.append(np.clip(np.nan_to_num(self.centres[-1], nan=1.0), 1.0, last))
            self.uphill.append(np.clip(_on_nodes(costs.uphill, kept), 1.0, last))
        self.known = known.values

    def up_to(self, ceiling: float) -> Potential:
        """Return V, as far as it is below a ceiling; a higher one than before begins with the predecessors known.

        It does not begin with the values known: next to a ceiling they are too small, and a value that is too small
        stays where motion without noise returns to, in the basin of another attractor.
        """
        self.ceilings = [np.minimum(bound, ceiling) for bound in self.bounds]
        self.values = [np.minimum(*both) for both in zip(self.known, self.ceilings, strict=True)]
        self.predecessors = [known.copy() for known in self.predecessors]
        unsettled = self._improve()
        return Potential(self.grids, self.values, self.predecessors, self.fixed[0], self.orbit, ceiling, unsettled)

    def _improve(self) -> float:
        """Sweep, period by period, until V stays the same even after every node was evaluated once more.

        Return the part of V by which it may still change.
        """
        active, risen = self._all(), False
        levels, at_rest = [self._level()], np.inf
        for period in range(_MOST_PERIODS):
            # V falls, except where it changes between predecessors that cost almost the same: then all must improve.
            improving = risen or period < _CYCLE * _IMPROVING or period % _CYCLE == 0
            changes = self._period(period, active, improving=improving)
            advance(self.sweeps)
            if period % _CYCLE == _CYCLE - 1:
                level = self._level()
                if changes == 0 or abs(levels[-1] - level) <= _CONVERGED * level:
                    if abs(at_rest - level) <= _CONVERGED * level:
                        return 0.0
                    at_rest, active = level, self._all()
                risen = risen or level > (1 + _CONVERGED) * levels[-1]
                levels.append(level)
                if _goes_round(levels):
                    return 2 * float(np.ptp(levels[-_ROUND:])) / level
        return 2 * _left(levels)

    def _all(self) -> list[Flags]:
        return [np.ones(self.grids.shape, dtype=np.uint8) for _ in range(self.grids.phases)]

    def _period(self, period: int, active: list[Flags], *, improving: bool) -> int:
        """Sweep over all phases; return the number of nodes that changed.

        A node takes over predecessors from neighbours that the same task has evaluated before it. The order of the
        nodes and the rows where tasks begin change from period to period, so that no row stops this.
        """
        turn = (period + period // _CYCLE) % 4
        order, begin = (1, -1)[turn % 2], -(turn // 2) * _ROWS // 2
        wide = period % _CYCLE == 0 and period < _CYCLE * _WIDE_SEARCHES
        reach = _REACH if wide else 0
        changes = 0
        for sweep in range(self.sweeps):
            phase = sweep % self.grids.phases
            if improving:
                changes += self._sweep(sweep_rows, _ROWS, begin, phase, active, (self.uphill[phase], order, reach))
            else:
                changes += self._sweep(evaluate_rows, _ROWS_EVALUATED, 0, phase, active, ())
        return changes

    def _sweep(
        self,
        work: Callable[..., None],
        rows: int,
        begin: int,
        phase: int,
        active: list[Flags],
        more: tuple[Any, ...],
    ) -> int:
        """Advance V by one step of time, so many rows in a task; return the number of nodes that changed."""
        after = (phase + 1) % self.grids.phases
        before = self.values[phase] if after != phase else self.values[phase].copy()
        changed = np.zeros(self.grids.shape, dtype=np.uint8)
        arrays = (
            before,
            self.values[after],
            self.centres[phase],
            self.roots[phase],
            self.predecessors[phase],
            self.ceilings[after],
            self.fixed[after].view(np.uint8),
            active[phase],
            changed,
        )
        last = len(before)
        tasks = [
            (*arrays, max(0, first), min(first + rows, last), _TOLERANCE, *more) for first in range(begin, last, rows)
        ]
        for _ in carry(work, tasks):
            pass
        active[after] = ndimage.maximum_filter(changed, size=_NEIGHBOURHOOD)
        return int(changed.sum())

    def _level(self) -> float:
        """Mean of √V on the section, which weights small values: a number that shows whether V has converged."""
        return float(np.mean(np.sqrt(self.values[0])))


def _goes_round(levels: Sequence[float]) -> bool:
    """Whether V changes up and down between predecessors that cost almost the same, and drifts far less than that."""
    if len(levels) <= 2 * _ROUND:
        return False
    earlier, later = levels[-2 * _ROUND : -_ROUND], levels[-_ROUND:]
    return float(np.ptp(later)) > _DRIFT * abs(float(np.mean(later) - np.mean(earlier)))


def _left(levels: Sequence[float]) -> float:
    """Return the part by which levels still change, if they go on as in the last two times 5 cycles; at most 1."""
    recent = np.array(levels[-2 * _ROUND - 1 :])
    changes = np.diff(recent)
    if not (np.all(changes <= 0) or np.all(changes >= 0)):
        return float(np.ptp(recent) / recent[-1])
    half = len(changes) // 2
    earlier, later = np.abs([changes[:half].sum(), changes[half:].sum()])
    return float(min(1.0, later**2 / (earlier - later) / recent[-1])) if later < earlier else 1.0


def _on_nodes(rows: Array, kept: Mask) -> Array:
    """Put rows at the nodes that were kept, NaN at the others."""
    found = np.full((*kept.shape, *rows.shape[1:]), np.nan)
    found[kept] = rows
    return found
