"""The quasi-potential on grids, by value iteration with continuous predecessors."""

from __future__ import annotations

import concurrent.futures
import dataclasses

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from vibrokit.analyzers.screening.grids import Grids
from vibrokit.analyzers.screening.seeds import seeds
from vibrokit.analyzers.screening.tables import against, step_cost, table
from vibrokit.kernels.ensemble import carry
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.sweeps import interpolate_all, sweep_rows
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor

_ROWS = 16  # of a piece of work; fixed, so that the result is the same on any number of processors
_WIDENING = 7  # cells, across: how far a change is felt
_TOLERANCE = 1e-5  # of V: a smaller change is not passed on
_REACH = 8  # cells among which a sweep looks for cheaper predecessors
_LOOK_EVERY = 4  # periods
_LOOKS = 8
_SETTLED = 2e-6  # change of V, in four periods, that is none
_MOST_PERIODS = 400
_BLUR = 2  # cells

Array = NDArray[np.float64]
Flags = NDArray[np.uint8]


@dataclasses.dataclass(frozen=True, eq=False)
class Potential:
    """Least action V from an attractor to every node of every phase.

    Attributes
    ----------
    grids : Grids
    values : list of array (nx, nv)
        By phase; `unreached` where no path is known.
    places : list of array (nx, nv, 2)
        By phase of the start of the step: from where each node of the next phase is reached best, in cells.
    tables : list of (array, array)
        Costs of the steps from each phase, as `tables.table` has them.
    given : list of bool array (nx, nv)
        Nodes whose V was given.
    orbit : array (count, 2)
        States of the attractor from phase to phase, if it is an orbit; else empty.
    unreached : float
    """

    grids: Grids
    values: list[Array]
    places: list[Array]
    tables: list[tuple[Array, Array]]
    given: list[NDArray[np.bool_]]
    orbit: Array
    unreached: float

    def at(self, phase: int, states: Array) -> Array:
        """Return V at states (count, ≥ 2); NaN outside the grid."""
        places = np.where(self.grids.inside(phase, states)[:, None], self.grids.places(phase, states), np.nan)
        return interpolate_all(self.values[phase], np.ascontiguousarray(places))

    def blur(self, phase: int, state: Array) -> float:
        """Return by how much V rises within two cells of a state, which a grid cannot tell from it."""
        return float(self._near(phase, state, (_BLUR, _BLUR)).max() - self.at(phase, state[None])[0])

    def fall(self, phase: int, state: Array, room: Array) -> float:
        """Return by how much V is lower within some distance in x and in v of a state."""
        wide, high = np.ceil(room / self.grids.spacing(phase)).astype(int)
        return float(self.at(phase, state[None])[0] - self._near(phase, state, (int(wide), int(high))).min())

    def _near(self, phase: int, state: Array, reach: tuple[int, int]) -> Array:
        """V at the nodes within so many cells of a state."""
        s, t = np.rint(self.grids.places(phase, state)).astype(int)
        return self.values[phase][max(s - reach[0], 0) : s + reach[0] + 1, max(t - reach[1], 0) : t + reach[1] + 1]


class Iteration:
    """Sweeps over the phases, until nothing changes. Holds what changes; `potential` is what came of it."""

    def __init__(
        self,
        osc: Oscillator,
        stepper: Stepper,
        attractor: Attractor,
        grids: Grids,
        unreached: float,
        executor: concurrent.futures.Executor,
    ) -> None:
        self.grids, self.unreached, self.executor = grids, unreached, executor
        self.steps = round(osc.section_interval / grids.step)
        known = seeds(osc, stepper, attractor, grids)
        self.orbit = known.orbit
        self.given = [np.isfinite(values) for values in known.values]
        self.most = [np.full(grids.cells, unreached) for _ in known.values]
        self.places, self.anchors, self.tables = [], [], []
        for phase in range(grids.phases):
            centres, roots = table(osc, stepper, grids, phase, executor)
            most = self.most[(phase + 1) % grids.phases]
            for place in grids.places(phase, known.visits(phase)):
                np.fmin(most, step_cost(place - centres, roots), out=most)
            self.tables.append((centres, roots))
            last = np.array(grids.cells) - 2.0
            self.places.append(np.clip(np.nan_to_num(centres, nan=1.0), 1.0, last))
            self.anchors.append(np.clip(against(osc, stepper, grids, phase), 1.0, last))

        self.values = [np.minimum(*both) for both in zip(known.values, self.most, strict=True)]

    def run(self) -> Potential:
        """Sweep, period by period, until V no longer changes, even where every node is looked at once more."""
        awake = self._all()
        before, rested = self._level(), np.inf
        for period in range(_MOST_PERIODS):
            changes = self._period(period, awake)
            if period % _LOOK_EVERY == _LOOK_EVERY - 1:
                level = self._level()
                if changes == 0 or abs(before - level) <= _SETTLED * level:
                    if abs(rested - level) <= _SETTLED * level:
                        break
                    rested, awake = level, self._all()
                before = level
        return Potential(self.grids, self.values, self.places, self.tables, self.given, self.orbit, self.unreached)

    def _all(self) -> list[Flags]:
        return [np.ones(self.grids.cells, dtype=np.uint8) for _ in range(self.grids.phases)]

    def _period(self, period: int, awake: list[Flags]) -> int:
        """Sweep over all phases; return how many nodes changed.

        Nodes learn from neighbours that are done before them in the same piece of work. So the order of nodes and the
        rows where pieces begin change from period to period, lest what is known on one side of a row stays there.
        """
        turn = (period + period // _LOOK_EVERY) % 4
        order, begin = (1, -1)[turn % 2], -(turn // 2) * _ROWS // 2
        look = period % _LOOK_EVERY == 0 and period < _LOOK_EVERY * _LOOKS
        reach = _REACH if look else 0
        return sum(self._sweep(step % self.grids.phases, awake, order, begin, reach) for step in range(self.steps))

    def _sweep(self, phase: int, awake: list[Flags], order: int, begin: int, reach: int) -> int:
        """Carry V one step of time on; return how many nodes changed."""
        after = (phase + 1) % self.grids.phases
        before = self.values[phase] if after != phase else self.values[phase].copy()
        still, changed = self.given[after].view(np.uint8), np.zeros(self.grids.cells, dtype=np.uint8)
        common = (
            before,
            self.values[after],
            *self.tables[phase],
            self.places[phase],
            self.anchors[phase],
            still,
            awake[phase],
            changed,
        )
        rows = len(before)
        tasks = [
            (*common, max(0, first), min(first + _ROWS, rows), order, reach, self.most[after], _TOLERANCE)
            for first in range(begin, rows, _ROWS)
        ]
        for _ in carry(sweep_rows, tasks, self.executor):
            pass
        awake[after] = ndimage.maximum_filter(changed, size=_WIDENING)
        return int(changed.sum())

    def _level(self) -> float:
        """A number that tells whether V has settled on the section: its mean, weighted where it is small."""
        return float(np.mean(np.sqrt(self.values[0])))
