"""Carries extremal paths to their exits, and confirms exits by where they settle."""

from __future__ import annotations

import dataclasses
import math
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.exits import Exit
from vibrokit.kernels.ensemble import Progress, Stop, run_ensemble
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.stopping import LEFT_BASIN, LEFT_REGION, NOT_FINITE, RAN_OUT, STALLED
from vibrokit.oscillator import Oscillator
from vibrokit.results.basins import LEFT, UNSETTLED
from vibrokit.results.structure import Structure
from vibrokit.structure.settle import Settler
from vibrokit.symbolic.flow_kind import Flow

_ROUNDS = 40
_BATCH = 256
_PARTS = 8
_PATIENCE = 4.0
_LEAST_BUDGET = 100

Array = NDArray[np.float64]
Whole = NDArray[np.int64]


@dataclasses.dataclass(frozen=True, eq=False)
class Outcomes:
    """How some paths ended.

    Attributes
    ----------
    begun : array (count, 2n + 1)
        (q, p, S) at the first section.
    section : int array (count,)
        Which section that is, counted from the attractor's first point.
    states : array (count, 2n + 1)
        Last (q, p, S).
    status : int array (count,)
        Constants of `vibrokit.kernels.stopping`.
    intervals : int array (count,)
        Looks from the first section to the end.
    targets : int array (count,)
        Label of the attractor that the exit leads to: of the exit's cell, or once confirmed of where it settled; −1
        where that is unknown or was not asked.
    confirmed : bool array (count,)
        Whether the exit is one for certain.
    leaving : int
        Status of those that have left.
    """

    begun: Array
    section: Whole
    states: Array
    status: Whole
    intervals: Whole
    targets: Whole
    confirmed: NDArray[np.bool_]
    leaving: int

    @property
    def actions(self) -> Array:
        """Action of each exit, NaN for paths without."""
        return np.where(self.status == self.leaving, self.states[:, -1], np.nan)

    @property
    def best(self) -> int | None:
        """The confirmed exit of least action."""
        which = np.flatnonzero(self.confirmed)
        return int(which[np.argmin(self.states[which, -1])]) if len(which) else None

    def least(self, targets: int) -> Array:
        """Return the least confirmed action of each target, infinite where there is none; last, of unknown targets.

        Parameters
        ----------
        targets : int
            How many there are.
        """
        least = np.full(targets + 1, np.inf)
        np.minimum.at(least, self.targets[self.confirmed], self.states[self.confirmed, -1])
        return least

    def joined(self, more: Outcomes) -> Outcomes:
        """These and some more."""
        names = [field.name for field in dataclasses.fields(self) if field.name != "leaving"]
        arrays = {name: np.concatenate([getattr(self, name), getattr(more, name)]) for name in names}
        return Outcomes(**arrays, leaving=self.leaving)

    def summary(self) -> str:
        """What became of the paths, as a sentence."""
        ways = {
            "left": np.sum(self.status == self.leaving),
            "left the region, which counts as no exit": np.sum(
                (self.status == LEFT_REGION) & (self.status != self.leaving)
            ),
            "were still inside at the end": np.sum(self.status == RAN_OUT),
            "ran out of range": np.sum(np.isin(self.status, (NOT_FINITE, STALLED))),
        }
        words = [f"{count} {what}" for what, count in ways.items() if count]
        found = "" if self.best is not None else " No exit was confirmed: raise the budget, or widen the region."
        return f"of {len(self.status)} paths {', '.join(words)}.{found}"


@dataclasses.dataclass(frozen=True, eq=False)
class Shooter:
    """Carries paths away from one attractor.

    Attributes
    ----------
    osc : Oscillator
    structure : Structure
    home : int
        Label of the attractor.
    exit : Exit
    stepper : Stepper
    budget : int
        Most section intervals of a path.
    """

    osc: Oscillator
    structure: Structure
    home: int
    exit: Exit
    stepper: Stepper
    budget: int

    @property
    def interval(self) -> float:
        """From look to look (s)."""
        return self.osc.section_interval / self.exit.looks(self.osc)

    @cached_property
    def stop(self) -> Stop:
        """The exit's test."""
        return self.exit.stop(self.osc, self.structure, self.home)

    def shoot(self, starts: Array, times: Array, progress: Progress | None = None) -> Outcomes:
        """Carry starts (count, 2n + 1) at some times (s) to their exits, not confirmed yet where that is needed."""
        begun, section = self._to_section(starts, times)
        ended = run_ensemble(
            self.osc, Flow.HAMILTONIAN, self.stepper, begun, self.budget * self.exit.looks(self.osc),
            stop=self.stop, interval=self.interval, progress=progress,
        )  # fmt: skip
        sure = ended.status == self.exit.leaving if self._by_position else np.zeros(len(starts), dtype=bool)
        return Outcomes(
            begun, section, ended.states, ended.status, ended.intervals, ended.label, sure, self.exit.leaving
        )

    def confirm(self, outcomes: Outcomes, worth: float = 1.0) -> None:
        """Let the cheapest exits flow on, in place, until the best to each target is certain.

        One that settles on another attractor is confirmed, wherever it was when it left. One that falls back to its own
        had only brushed the boundary, where cells are coarse, and is carried on; one that settles on none is no exit.

        Parameters
        ----------
        outcomes : Outcomes
        worth : float
            Times the least action of a target, up to which all its exits are made certain.
        """
        if self._by_position:
            return
        for _ in range(_ROUNDS):
            open_ = np.flatnonzero(np.isin(outcomes.status, (LEFT_BASIN, LEFT_REGION)) & ~outcomes.confirmed)
            action = outcomes.states[open_, -1]
            doubtful = open_[action < self._ceilings(outcomes, worth)[outcomes.targets[open_]]]
            if not len(doubtful):
                return
            ranked = doubtful[np.argsort(outcomes.states[doubtful, -1], kind="stable")]
            self._settle(outcomes, ranked[: max(_BATCH, len(ranked) // _PARTS)])

    def _ceilings(self, outcomes: Outcomes, worth: float) -> Array:
        """Actions below which exits need be certain, by target; last, those of unknown target."""
        least = outcomes.least(len(self.structure.attractors))
        return np.append(worth * least[:-1], least.min())

    def _settle(self, outcomes: Outcomes, which: Whole) -> None:
        states = outcomes.states[which]
        reached = self._settler.labels(states[:, : (states.shape[1] - 1) // 2])
        away = reached != self.home
        settled = which[away & (reached >= 0)]
        outcomes.targets[settled] = reached[away & (reached >= 0)]
        outcomes.confirmed[settled] = True
        outcomes.status[settled] = LEFT_BASIN
        outcomes.status[which[reached == UNSETTLED]] = RAN_OUT
        outcomes.status[which[reached == LEFT]] = NOT_FINITE
        again = which[~away]
        looks = self.budget * self.exit.looks(self.osc)
        more = run_ensemble(
            self.osc, Flow.HAMILTONIAN, self.stepper, states[~away], np.maximum(looks - outcomes.intervals[again], 0),
            stop=self.stop, interval=self.interval,
        )  # fmt: skip
        outcomes.states[again], outcomes.status[again], outcomes.targets[again] = more.states, more.status, more.label
        outcomes.intervals[again] += more.intervals

    @cached_property
    def _settler(self) -> Settler:
        known = self.structure
        return Settler(self.osc, known.attractors, known.basins.region, known.settling, known.budget, self.stepper)

    @property
    def _by_position(self) -> bool:
        """Whether the exit is where the mass is, so that nothing need be confirmed."""
        return self.exit.leaving == LEFT_REGION

    def _to_section(self, starts: Array, times: Array) -> tuple[Array, Whole]:
        """Carry starts between two sections to the next."""
        unit = self.osc.section_interval
        section = np.ceil(times / unit - 1e-9).astype(np.int64)
        begun = starts.copy()
        for time in np.unique(times):
            here, rest = times == time, float(math.ceil(time / unit - 1e-9) * unit - time)
            if rest > 1e-9 * unit:
                ended = run_ensemble(
                    self.osc, Flow.HAMILTONIAN, self.stepper, starts[here], start_time=time % unit, interval=rest
                )
                begun[here] = ended.states
        return begun, section


def default_budget(slowest: float, period: int, growth: float) -> int:
    """Return a number of section intervals that lets deviations grow by a factor, with patience.

    Parameters
    ----------
    slowest : float
        Size of the orbit's largest multiplier.
    period : int
        Of the orbit, in section intervals.
    growth : float
    """
    decay = -math.log(max(slowest, 1e-12)) / period
    return _LEAST_BUDGET + math.ceil(_PATIENCE * max(0.0, math.log(growth)) / decay)
