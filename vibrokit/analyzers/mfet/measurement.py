"""Measurement: the exit rates of one attractor at one noise intensity, directly or by splitting."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.checkpoint import Slot
from vibrokit.analyzers.exits import LeaveBasin
from vibrokit.analyzers.metastability import targets_at
from vibrokit.analyzers.mfet.direct import DirectRun, Escapes, Exits
from vibrokit.analyzers.mfet.estimates import (
    RateEstimate,
    exponential_p_value,
    mean_tests,
    rate_around,
    rate_of,
    rate_unseen,
)
from vibrokit.analyzers.mfet.importance import Importance, from_distances
from vibrokit.analyzers.mfet.splitting import SplittingRun
from vibrokit.analyzers.mfet.walk import Walk
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.errors import StructureError
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.stopping import COMPLETED
from vibrokit.results.basins import ESCAPED
from vibrokit.results.codes import Code
from vibrokit.results.finding import Finding
from vibrokit.results.rated import METASTABLE

# Direct simulation costs e^Λ relaxations for each exit, splitting about 2 Λ² (Λ is ln of the mean exit time in
# relaxations), times what its importance function and its density cost: they break even near Λ = 7.
_DIRECT = math.exp(7.0)
_PILOT = 10  # exits of walkers of their own, by which the choice is made
_IDLE = 5.0  # relaxations in which no walker has time to leave
_STEP_SHARE = 4  # a part of the exits is simulated with half the steps
_LEAST_CHECKED = 25
_SIGNIFICANT = 3.0  # standard errors
_UNLIKELY = 1e-3  # probability below which exit times are not exponential

Array = NDArray[np.float64]


class Settings(Protocol):
    """What a measurement reads of an analyzer."""

    @property
    def target_error(self) -> float: ...
    @property
    def seed(self) -> int: ...
    @property
    def splitting(self) -> bool | None: ...
    @property
    def from_orbit(self) -> bool: ...
    @property
    def replicas(self) -> int: ...
    @property
    def escapes(self) -> int: ...


@dataclasses.dataclass(frozen=True, eq=False)
class AtIntensity:
    """What was found at one intensity.

    Attributes
    ----------
    intensity : float
    method : str
        ``"direct"`` or ``"splitting"``.
    rates : mapping of int to RateEstimate
        By target; ln of rates in s⁻¹.
    exits : Exits or None
    interval : float
        Time between exit tests (s).
    p_value : float
        Of the test for an exponential law.
    step_change, step_change_error : float
        What half the steps change in ln of the rate of all exits, and its standard error.
    escapes : Escapes or None
    metastable : bool
        Whether the state lasts much longer than its relaxation: otherwise the rate says nothing about ΔU.
    findings : tuple of Finding
    """

    intensity: float
    method: str
    rates: Mapping[int, RateEstimate]
    exits: Exits | None
    interval: float
    p_value: float = math.nan
    step_change: float = math.nan
    step_change_error: float = math.nan
    escapes: Escapes | None = None
    metastable: bool = True
    findings: tuple[Finding, ...] = ()


class Measurement:
    """The work at one intensity.

    Parameters
    ----------
    problem : ExitProblem
    intensity : float
    settings : Settings
    stepper : Stepper
    covariances : mapping of int to array
    importance : callable
        Returns an importance function, or None.
    slot : Slot
        Its place in the checkpoint.
    """

    def __init__(
        self,
        problem: ExitProblem,
        intensity: float,
        settings: Settings,
        stepper: Stepper,
        covariances: Mapping[int, Array],
        importance: Callable[[Walk], Importance | None],
        slot: Slot,
    ) -> None:
        self.problem, self.settings, self.importance, self.slot = problem, settings, importance, slot
        self.walk = Walk(problem, intensity, settings.seed, stepper, covariances)
        self._direct: DirectRun | None = None
        self._splitting: SplittingRun | None = None

    def run(self) -> AtIntensity:
        """Simulate exits; split if that is wanted, or if it would take too long."""
        if self._exits_are_frequent():
            wanted = math.ceil(self.settings.target_error**-2)
            self._direct = self._begun(self.walk, wanted, "direct", 10)
            self._direct.run()
            return self._from_direct(self._direct, self._checked_steps(wanted))
        importance = self.importance(self.walk) or from_distances(self.walk)
        self._splitting = SplittingRun(
            self.walk, importance, self.settings.target_error, self.settings.replicas, self.slot.inner("splitting")
        )
        self._splitting.run()
        return self._from_splitting(self._splitting)

    def so_far(self) -> AtIntensity | None:
        """What is known if the work is stopped; None if that is nothing."""
        if self._splitting is not None and self._splitting.batches:
            return self._from_splitting(self._splitting)
        if self._direct is not None and self._direct.at_risk > 0:
            return self._from_direct(self._direct, None)
        return None

    def _exits_are_frequent(self) -> bool:
        """Whether to simulate exits directly.

        Exits that decide this do not count in the rate: if early exits choose a method and count, rates are too large.
        """
        if self.settings.splitting is not None or self.problem.has_bystanders:
            return self.settings.splitting is not True
        self._direct = self._begun(self.walk, _PILOT, "pilot", 14)
        return self._direct.run(_PILOT * _DIRECT * self.walk.relaxation)

    def _begun(self, walk: Walk, wanted: int, name: str, *key: int) -> DirectRun:
        count = DirectRun.walkers_for(wanted)
        if self.settings.from_orbit:
            begun = walk.from_orbit(self.problem.attractor, count, *key)
        else:
            begun = walk.from_core(count, *key)
        return DirectRun(walk, wanted, begun, self.slot.inner(name))

    def _checked_steps(self, wanted: int) -> DirectRun | None:
        """A part of the exits with half the steps; None if there are no fewer steps."""
        coarser = self.walk.stepper.coarsened()
        if coarser == self.walk.stepper:
            return None
        walk = dataclasses.replace(self.walk, stepper=coarser)
        try:
            run = self._begun(walk, max(_LEAST_CHECKED, wanted // _STEP_SHARE), "coarser", 11)
        except StructureError:
            return None
        run.run()
        return run

    def _from_direct(self, run: DirectRun, coarser: DirectRun | None) -> AtIntensity:
        walk, exits = self.walk, run.exits()
        targets = {*np.unique(exits.targets).tolist(), *self._awaited}
        rates = {t: _in_seconds(rate_of(exits, int((exits.targets == t).sum())), walk) for t in targets}
        p_value = exponential_p_value(exits, walk.key(12))
        change, change_error = math.nan, math.nan
        if coarser is not None and len(exits) and coarser.left:
            other = coarser.exits()
            change = math.log(mean_tests(exits) / mean_tests(other))
            change_error = math.hypot(len(exits) ** -0.5, len(other) ** -0.5)
        return AtIntensity(
            walk.intensity, "direct", rates, exits, walk.interval, p_value, change, change_error,
            run.escapes(self.settings.escapes) if self.settings.escapes and run.left else None,
            not len(exits) or mean_tests(exits) >= METASTABLE * walk.relaxation * walk.checks,
            tuple(self._found(exits, p_value, change, change_error)),
        )  # fmt: skip

    def _found(self, exits: Exits, p_value: float, change: float, change_error: float) -> list[Finding]:
        """What limits the rates."""
        source, intensity, walk = self.problem.source, self.walk.intensity, self.walk
        found = list[Finding]()
        if not len(exits):
            # Nobody leaves at once: the first relaxations of each walker are no evidence.
            idle = math.ceil(_IDLE * walk.relaxation) * walk.checks * exits.censored
            seen = dataclasses.replace(exits, at_risk=max(exits.at_risk - idle, 1))
            bound = math.exp(-_in_seconds(rate_of(seen, 0), walk).log_upper)
            found.append(Finding.of(Code.NO_EXIT_SEEN, source, intensity=intensity, time=bound))
            return found
        if p_value < _UNLIKELY:
            found.append(Finding.of(Code.NOT_EXPONENTIAL, source, intensity=intensity, p_value=p_value))
        if abs(change) > _SIGNIFICANT * change_error:
            found.append(
                Finding.of(Code.STEPS_CHANGE_RATE, source, intensity=intensity, change=change, error=change_error)
            )
        for target in np.unique(exits.targets).tolist():
            share = self._kept(target) if target >= 0 and not self.problem.exit.by_position else 1.0
            if share < 0.5:
                found.append(Finding.of(Code.TARGET_NOT_METASTABLE, source, target, intensity=intensity, share=share))
        return found

    @property
    def _awaited(self) -> tuple[int, ...]:
        """Labels of the targets for which something is said even if no exit leads there: a bound."""
        if self.problem.exit.by_position:
            return ()
        targets = [target.label for target in targets_at(self.problem, self.walk.intensity)]
        return (*targets, ESCAPED) if np.isfinite(self.problem.faces).any() else tuple(targets)

    def _kept(self, target: int) -> float:
        """Share of walkers that stay at a target for a few relaxations of it."""
        structure = self.problem.structure
        other = dataclasses.replace(self.problem, attractor=structure.attractors[target], exit=LeaveBasin())
        walk = dataclasses.replace(self.walk, problem=other)
        left = walk.arrival
        begun = walk.from_orbit(other.attractor, 200, 13)
        ended = walk.advance(begun, math.ceil(METASTABLE / 2 * walk.relaxation), left)
        return float((ended.status == COMPLETED).mean())

    def _from_splitting(self, run: SplittingRun) -> AtIntensity:
        walk, estimates = self.walk, run.estimates
        count = len(estimates.log_values)
        rates = {}
        for target, (share, spread) in estimates.shares().items():
            if share > 0:
                both = math.hypot(estimates.error, spread / share)
                whole = rate_around(estimates.log_mean + math.log(share), both, count)
                rates[target] = _in_seconds(whole, walk, tests=walk.checks)
        for target in self._awaited if rates else ():
            unseen = rate_unseen(estimates.log_mean, count)
            rates.setdefault(target, _in_seconds(unseen, walk, tests=walk.checks))
        findings = list[Finding]()
        source, wanted, error = self.problem.source, self.settings.target_error, estimates.error
        if not rates:
            findings.append(Finding.of(Code.NO_EXCURSION_LEFT, source, intensity=walk.intensity, replicas=count))
        elif error > wanted:
            findings.append(
                Finding.of(
                    Code.SPLITTING_NOT_CONVERGED, source,
                    intensity=walk.intensity, error=error, wanted=wanted, replicas=count,
                )
            )  # fmt: skip
        return AtIntensity(walk.intensity, "splitting", rates, None, walk.interval, findings=tuple(findings))


def _in_seconds(rate: RateEstimate, walk: Walk, tests: int = 1) -> RateEstimate:
    """The rate in s⁻¹ of one that is per so many intervals between tests."""
    shift = math.log(walk.interval * tests)
    return RateEstimate(rate.log_value - shift, rate.log_error, rate.log_lower - shift, rate.log_upper - shift)
