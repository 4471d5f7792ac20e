"""Direct simulation: walkers go on until they leave."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.checkpoint import Slot
from vibrokit.analyzers.mfet.walk import Walk, Walkers
from vibrokit.kernels.ensemble import Stop
from vibrokit.kernels.stopping import COMPLETED, DIVERGED
from vibrokit.progress import report, stage

Array = NDArray[np.float64]
Whole = NDArray[np.int64]


@dataclasses.dataclass(frozen=True, eq=False)
class Exits:
    """What some walkers have done so far."""

    tests: Whole  # until each exit, in ascending order
    targets: Whole  # label that each exit leads to; −1 for an exit that is no attractor, −2 for escape
    at_risk: int  # exit tests of all walkers together, also of those that have not left
    censored: int  # walkers that have not left

    def __len__(self) -> int:
        return len(self.tests)


@dataclasses.dataclass(frozen=True, eq=False)
class Escapes:
    """Realizations on their way out, aligned at the exit."""

    times: Array  # (samples,): since the exit (s), up to 0
    paths: Array  # (count, samples, 2): x and v; NaN before the start of a walker
    targets: Whole  # (count,)


@dataclasses.dataclass(frozen=True, eq=False)
class _State:
    """All walkers: now, and at the beginnings of the last two rounds."""

    states: Array
    streams: NDArray[np.uint64]
    tests: Whole  # exit tests so far
    status: Whole
    targets: Whole
    earlier_states: Array
    earlier_streams: NDArray[np.uint64]
    earlier_tests: Whole


class DirectRun:
    """Simulation of exits, which can be stopped and goes on where it was.

    It ends with the first round after which the wanted number of walkers have left. The others are censored at that
    time, all at the same one, so that nothing waits for the last walkers, and the estimate is unbiased for exponential
    times. Walkers start in the core, or on the orbit. The state is kept in a slot; the key chooses the random streams.
    """

    def __init__(self, walk: Walk, wanted: int, from_orbit: bool, slot: Slot, key: int) -> None:
        self.walk, self.wanted, self.slot = walk, wanted, slot
        count = math.ceil(1.25 * wanted)  # the last of the exits would take long, and they are not waited for
        begun = walk.from_orbit(count, key) if from_orbit else walk.from_core(count, key)
        none = np.zeros(count, dtype=np.int64)
        self.state = _State(
            begun.states, begun.streams, none, np.full(count, COMPLETED, dtype=np.int64), none - 1,
            np.stack([begun.states] * 2), np.stack([begun.streams] * 2), np.stack([none] * 2),
        )  # fmt: skip
        known = slot.read([field.name for field in dataclasses.fields(_State)])
        if known is not None:
            self.state = _State(**known)

    @property
    def left(self) -> int:
        """Walkers that have left."""
        return int((self.state.status != COMPLETED).sum())

    @property
    def at_risk(self) -> float:
        """Section intervals of all walkers."""
        return float(self.state.tests.sum()) / self.walk.checks

    def run(self, most: float = math.inf) -> bool:
        """Go on until it is done; return False if it is not after so many section intervals of all walkers."""
        with stage("direct simulation", unit="exits", total=self.wanted):
            while self.left < self.wanted:
                report(self.left, self.wanted)
                if self.at_risk > most:
                    return False
                self.state = self._later()
                self.slot.write(vars(self.state))
            report(self.wanted, self.wanted)
        return True

    def _later(self) -> _State:
        """The state one round later, all in new arrays, so that an interrupt leaves that of the round before.

        A round lasts an eighth of all rounds before it, and so long that the last two can be repeated.
        """
        now, checks = self.state, self.walk.checks
        alive = np.flatnonzero(now.status == COMPLETED)
        passed = int(now.tests[alive].max()) // checks
        sections = min(max(self.walk.memory, passed // 8), self.walk.sections_at_once(len(alive)))
        ended = self.walk.advance(Walkers(now.states[alive], now.streams[alive]), sections)
        later = _State(*(value.copy() for value in vars(now).values()))
        for earlier, current in (
            (later.earlier_states, now.states), (later.earlier_streams, now.streams), (later.earlier_tests, now.tests),
        ):  # fmt: skip
            earlier[0, alive], earlier[1, alive] = earlier[1, alive], current[alive]
        later.states[alive], later.streams[alive] = ended.states, ended.streams
        later.status[alive], later.targets[alive] = ended.status, ended.label
        later.tests[alive] += ended.intervals + (ended.status == DIVERGED)
        return later

    def exits(self) -> Exits:
        """Return what has happened so far."""
        tests = self.state.tests
        gone = self._in_order()
        return Exits(tests[gone], self.state.targets[gone], int(tests.sum()), len(tests) - len(gone))

    def escapes(self, most: int) -> Escapes:
        """Repeat the last part of some walkers that have left, early and late, with 16 states in a section interval."""
        walk, state, gone = self.walk, self.state, self._in_order()
        gone = gone[np.linspace(0, len(gone) - 1, min(most, len(gone))).astype(int)]
        sections = min(walk.memory + 16, 128)
        steps = walk.stepper.steps_in(walk.scene, walk.interval)
        pieces = max(n for n in range(1, max(1, 16 // walk.checks) + 1) if steps % n == 0)
        left = state.tests[gone] - state.earlier_tests[0, gone]
        ahead = np.maximum(left - sections * walk.checks, 0)
        ahead -= ahead % walk.checks
        start = Walkers(state.earlier_states[0, gone], state.earlier_streams[0, gone])
        begun = walk.advance(start, ahead // walk.checks, stop=Stop())
        count = (sections + 1) * walk.checks * pieces
        tests = np.minimum((left - ahead) * pieces, count)
        spacing = walk.interval / pieces
        ended = walk.moved(Walkers(begun.states, begun.streams), tests, Stop(), spacing, visits=count)
        paths = np.full((len(gone), count + 1, 2), np.nan)
        for number, (length, first) in enumerate(zip(tests, begun.states, strict=True)):
            paths[number, count - length] = first[:2]
            paths[number, count + 1 - length :] = ended.visits[number, :length, :2]
        first = count - int(tests.max())
        return Escapes(spacing * np.arange(first - count, 1.0), paths[:, first:], state.targets[gone])

    def _in_order(self) -> Whole:
        """The walkers that have left, in the order of their exits."""
        gone = np.flatnonzero(self.state.status != COMPLETED)
        return gone[np.argsort(self.state.tests[gone], kind="stable")]
