"""The quasi-potential on grids, by value iteration with continuous predecessors."""

from __future__ import annotations

import concurrent.futures
import dataclasses
import os

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from vibrokit.analyzers.graph.grids import Grids
from vibrokit.analyzers.graph.seeds import seeds
from vibrokit.analyzers.graph.step_model import StepModel
from vibrokit.kernels.ensemble import carry
from vibrokit.kernels.sweeps import interpolate_all, sweep_rows
from vibrokit.progress import advance
from vibrokit.results.attractor import Attractor

_ROWS = 16  # of one task; fixed, so that the result is the same on any number of processors
_NEIGHBOURHOOD = 7  # nodes across in which a change is felt: interpolation reaches 2 to each side, predecessors move 1
_TOLERANCE = 1e-5  # relative change of V that is not passed on; far below the error of interpolation
_REACH = 8  # nodes to each side among which a sweep looks for cheaper predecessors
_CYCLE = 4  # periods from one wide search for predecessors, and one test of convergence, to the next
_WIDE_SEARCHES = 8  # each evaluates up to (2 · 8 + 1)² nodes for every node, many times what following costs
_CONVERGED = 2e-6  # relative change of the mean of √V over a cycle
_MOST_PERIODS = 400
_BLUR = 2  # nodes within which a grid does not resolve V

Array = NDArray[np.float64]
Flags = NDArray[np.uint8]


@dataclasses.dataclass(frozen=True, eq=False)
class Potential:
    """Least action V from an attractor to every node of every phase."""

    grids: Grids
    values: list[Array]  # (nx, nv) for each phase; `ceiling` where no cheaper path is known
    predecessors: list[Array]  # (nx, nv, 2) for each phase: where the best step to a node of the next starts, as index
    seeded: NDArray[np.bool_]  # (nx, nv): nodes of the section whose V is known beforehand
    orbit: Array  # (count, 2): states of the attractor from phase to phase if it is an orbit; else empty
    ceiling: float  # V up to which paths are searched

    def at(self, phase: int, states: Array) -> Array:
        """Return V at states (count, ≥ 2); NaN outside the grid."""
        index = np.where(self.grids.inside(phase, states)[:, None], self.grids.index(phase, states), np.nan)
        return interpolate_all(self.values[phase], np.ascontiguousarray(index))

    def rise(self, phase: int, state: Array) -> float:
        """Return how much V rises within the nodes next to a state, which the grid cannot distinguish from it."""
        return float(self._near(phase, state, (_BLUR, _BLUR)).max() - self.at(phase, state[None])[0])

    def fall(self, phase: int, state: Array, distance: Array) -> float:
        """Return how much V falls within some distance in x and in v of a state."""
        wide, high = np.ceil(distance / self.grids.spacing(phase)).astype(int)
        return float(self.at(phase, state[None])[0] - self._near(phase, state, (int(wide), int(high))).min())

    def _near(self, phase: int, state: Array, reach: tuple[int, int]) -> Array:
        i, j = np.rint(self.grids.index(phase, state)).astype(int)
        return self.values[phase][max(i - reach[0], 0) : i + reach[0] + 1, max(j - reach[1], 0) : j + reach[1] + 1]


def quasi_potential(model: StepModel, attractor: Attractor, grids: Grids, ceiling: float) -> Potential:
    """Return the least action from an attractor to the nodes of some grids, as far as it is below a ceiling.

    Raises StructureError if the attractor is not hyperbolic.
    """
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as executor:
        return _Iteration(model, attractor, grids, ceiling, executor).run()


class _Iteration:
    """Value iteration: sweeps over the phases until V no longer changes."""

    def __init__(
        self,
        model: StepModel,
        attractor: Attractor,
        grids: Grids,
        ceiling: float,
        executor: concurrent.futures.Executor,
    ) -> None:
        self.grids, self.ceiling, self.executor = grids, ceiling, executor
        self.sweeps = round(model.scene.section_interval / grids.step)
        known = seeds(model, attractor, grids)
        self.orbit = known.orbit
        self.fixed = [np.isfinite(values) for values in known.values]
        self.ceilings = [np.full(grids.shape, ceiling) for _ in known.values]
        self.centres, self.roots, self.predecessors, self.uphill = [], [], [], []
        for phase in range(grids.phases):
            after = (phase + 1) % grids.phases
            costs = model.into(grids.nodes(after).reshape(-1, 2), grids, phase)
            for visit in grids.index(phase, known.orbit[phase :: grids.phases]):
                direct = costs.cost(visit).reshape(grids.shape)
                np.fmin(self.ceilings[after], direct, out=self.ceilings[after])
            last = np.array(grids.shape) - 2.0
            self.centres.append(costs.centres.reshape(*grids.shape, 2))
            self.roots.append(costs.roots.reshape(*grids.shape, 3))
            self.predecessors.append(np.clip(np.nan_to_num(self.centres[-1], nan=1.0), 1.0, last))
            self.uphill.append(np.clip(costs.uphill.reshape(*grids.shape, 2), 1.0, last))
        self.values = [np.minimum(*both) for both in zip(known.values, self.ceilings, strict=True)]

    def run(self) -> Potential:
        """Sweep, period by period, until V stays the same even after every node was evaluated once more."""
        active = self._all()
        before, at_rest = self._level(), np.inf
        for period in range(_MOST_PERIODS):
            changes = self._period(period, active)
            advance(self.sweeps)
            if period % _CYCLE == _CYCLE - 1:
                level = self._level()
                if changes == 0 or abs(before - level) <= _CONVERGED * level:
                    if abs(at_rest - level) <= _CONVERGED * level:
                        break
                    at_rest, active = level, self._all()
                before = level
        return Potential(self.grids, self.values, self.predecessors, self.fixed[0], self.orbit, self.ceiling)

    def _all(self) -> list[Flags]:
        return [np.ones(self.grids.shape, dtype=np.uint8) for _ in range(self.grids.phases)]

    def _period(self, period: int, active: list[Flags]) -> int:
        """Sweep over all phases; return the number of nodes that changed.

        A node takes over predecessors from neighbours that the same task has evaluated before it. The order of the
        nodes and the rows where tasks begin change from period to period, so that no row stops this.
        """
        turn = (period + period // _CYCLE) % 4
        order, begin = (1, -1)[turn % 2], -(turn // 2) * _ROWS // 2
        wide = period % _CYCLE == 0 and period < _CYCLE * _WIDE_SEARCHES
        reach = _REACH if wide else 0
        return sum(self._sweep(sweep % self.grids.phases, active, order, begin, reach) for sweep in range(self.sweeps))

    def _sweep(self, phase: int, active: list[Flags], order: int, begin: int, reach: int) -> int:
        """Advance V by one step of time; return the number of nodes that changed."""
        after = (phase + 1) % self.grids.phases
        before = self.values[phase] if after != phase else self.values[phase].copy()
        changed = np.zeros(self.grids.shape, dtype=np.uint8)
        arrays = (
            before,
            self.values[after],
            self.centres[phase],
            self.roots[phase],
            self.predecessors[phase],
            self.uphill[phase],
            self.ceilings[after],
            self.fixed[after].view(np.uint8),
            active[phase],
            changed,
        )
        rows = len(before)
        tasks = [
            (*arrays, max(0, first), min(first + _ROWS, rows), order, reach, _TOLERANCE)
            for first in range(begin, rows, _ROWS)
        ]
        for _ in carry(sweep_rows, tasks, self.executor):
            pass
        active[after] = ndimage.maximum_filter(changed, size=_NEIGHBOURHOOD)
        return int(changed.sum())

    def _level(self) -> float:
        """Mean of √V on the section, which weights small values: a number that shows whether V has converged."""
        return float(np.mean(np.sqrt(self.values[0])))
