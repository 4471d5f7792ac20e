"""The search for steady states: starts are followed until they recur, and those that do not are watched for long."""

from __future__ import annotations

import concurrent.futures
import dataclasses
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import StructureError
from vibrokit.kernels.ensemble import Progress, run_ensemble
from vibrokit.kernels.rk4 import RK4
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.results.basins import LEFT, UNSETTLED
from vibrokit.results.survival import Survival
from vibrokit.structure.attractors.bands import separate
from vibrokit.structure.attractors.describe import describe_cycle, describe_orbit, describe_wandering
from vibrokit.structure.attractors.lyapunov import kind_of, lyapunov_exponent
from vibrokit.structure.attractors.survival import follow, watch
from vibrokit.structure.cycles import find_cycle
from vibrokit.structure.orbits import EQUAL, least_period, refine_orbit, same_point, visited
from vibrokit.structure.scales import size_of
from vibrokit.symbolic.flow_kind import Flow

LONGEST_PERIOD = 16
_LONGER_PERIOD = 256  # looked for among those that are long in settling
_RECURRENCE = 1e-5
_NEAR = 1e-3  # what a coarse stepper may make of an orbit
_LOOSE = 1e-2  # recurrences that are worth a try with Newton's method
_GUESSES = 8
_FIRST_WAIT = 64  # periods; doubled from round to round
_WATCHED = 64  # starts that are followed for long
_LEAST_WATCHED = 16
_WATCH = 20_000  # periods
_MEASURED = 16  # starts of a Lyapunov exponent; it depends on the steps, so that they are carried exactly
_LEAST_MEASURED = 1000  # periods
_LEAST_STARTS = 4
_VISITS = 2048  # of each survivor, to see which are on one attractor
_OVERLAP = 4.0  # times the settling distance
_SAMPLE = 4096  # points of a set that never repeats
_FAILURES = 8  # states that come to no cycle, after which no more are tried
_REFINEMENTS = 4  # of a carrier, until every attractor is one for it too
_LONGEST_CYCLE = 50  # units of 2π/ω_n

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True)
class Means:
    """What the search integrates with.

    Attributes
    ----------
    carrier : Stepper
        For many starts.
    exact : Stepper
        For orbits.
    executor : concurrent.futures.Executor, optional
    progress : callable, optional
    """

    carrier: Stepper
    exact: Stepper
    executor: concurrent.futures.Executor | None = None
    progress: Progress | None = None


class Search:
    """Finds the steady states of a scene, one after another; what is found stays if the work is stopped.

    Parameters
    ----------
    osc : Oscillator
    means : Means
    tolerance : float
        Distance at which a state that is being watched counts as settled on a known orbit.
    """

    def __init__(self, osc: Oscillator, means: Means, tolerance: float) -> None:
        self.osc, self.means, self.tolerance = osc, means, tolerance
        self.attractors: list[Attractor] = []
        self.survival: tuple[Survival, ...] = ()
        self.starts = self.lost = 0
        self.words: list[str] = []

    def run(self, states: Array, wait: int, patient: bool) -> None:
        """Follow the states (count, n) until each recurs, is lost, or has shown that it never settles.

        Parameters
        ----------
        states : array (count, n)
        wait : int
            Periods that a transient is given; twice, for some are slow.
        patient : bool
            Whether that is as long as the damping asks for. If not, and nothing has settled, it was too short, and
            what goes on says nothing.
        """
        self.starts = len(states)
        for periods in _schedule(wait):
            states = self._after(states, periods)
            states = self._add_orbits(states, LONGEST_PERIOD)
            if not len(states):
                return
        if self.osc.autonomous:
            states = self._add_cycles(states)
            some = "Some" if len(states) == _FAILURES else len(states)
            self.words += [f"{some} starts settled on no equilibrium and no limit cycle."] if len(states) else []
        elif patient or self.attractors:
            self._watch(states)

    @property
    def _many(self) -> int:
        """How many starts are followed for long: fewer where contacts are located, trajectory by trajectory."""
        return _WATCHED if isinstance(self.means.carrier, RK4) else _LEAST_WATCHED

    def _after(self, states: Array, periods: int) -> Array:
        """Where the states are some periods later, without those that came to a known orbit and those that are lost."""
        means, known = self.means, [attractor.points for attractor in self.attractors]
        ended, labels = follow(
            self.osc, states, known, tolerance=self.tolerance, periods=periods, stepper=means.carrier,
            executor=means.executor, progress=means.progress,
        )  # fmt: skip
        self.lost += int(np.sum(labels == LEFT))
        return ended.states[labels == UNSETTLED]

    def _known(self, point: Array, tolerance: float) -> bool:
        return any(same_point(self.osc, point, known.points, tolerance) for known in self.attractors if known.repeats)

    def _add_orbits(self, states: Array, longest: int) -> Array:
        """Add the new stable orbits that states lie on; return the states that lie on none."""
        history = [states]
        for _ in range(longest):
            history.append(run_ensemble(self.osc, Flow.STATE, self.means.carrier, history[-1], 1).states)
        path = np.array(history)
        scale = size_of(self.osc) + np.abs(path).max(axis=(0, 2))
        distance = np.linalg.norm(path[1:] - path[0], axis=2) / scale
        close = distance < _RECURRENCE
        settled = close.any(axis=0)
        for index in np.flatnonzero(settled):
            period = int(np.argmax(close[:, index])) + 1
            settled[index] = self._known(path[0, index], _NEAR) or self._add_orbit(path[0, index], period)
        self._guess(path[:, ~settled], distance[:, ~settled])
        return path[0, ~settled]

    def _guess(self, path: Array, distance: Array) -> None:
        """Try Newton's method where the motion nearly recurs: an orbit known early spares the wait for it."""
        tried = 0
        for index in np.argsort(distance.min(axis=0)):
            nearest = float(distance[:, index].min())
            if tried == _GUESSES or nearest > _LOOSE:
                return
            if not self._known(path[0, index], _LOOSE):
                self._add_orbit(path[0, index], int(np.argmin(distance[:, index])) + 1)
                tried += 1

    def _add_orbit(self, point: Array, period: int) -> bool:
        """Add the orbit through a point that recurs, if it is new; return whether the point has settled on it."""
        exact = self.means.exact
        try:
            orbit = least_period(self.osc, refine_orbit(self.osc, point, period, exact), exact)
        except StructureError:
            return False
        unstable = np.abs(np.linalg.eigvals(orbit.monodromy)).max() >= 1
        if unstable or not same_point(self.osc, point, visited(self.osc, orbit, exact), _NEAR):
            return False  # passing by a saddle
        if not self._known(orbit.point, EQUAL):
            self.attractors.append(describe_orbit(self.osc, orbit, exact))
        return True

    def _add_cycles(self, states: Array) -> Array:
        """Add the limit cycles that states lie on; return the states that lie on none."""
        osc, left = self.osc, list[Array]()
        for state in states:
            if len(left) == _FAILURES:
                break
            known = [a.orbit for a in self.attractors if a.kind == "limit cycle"]
            if any(_on(orbit, state) for orbit in known):
                continue
            try:
                longest = _LONGEST_CYCLE * osc.section_interval
                cycle = find_cycle(osc, state, self.means.exact, longest=longest)
            except StructureError:
                left.append(state)
                continue
            if np.sort(np.abs(np.linalg.eigvals(cycle.monodromy)))[-2:][0] >= 1:
                left.append(state)
            elif not any(_on(orbit, cycle.point) for orbit in known):
                self.attractors.append(describe_cycle(osc, cycle, self.means.exact))
        return np.array(left).reshape(-1, states.shape[1])

    def _watch(self, states: Array) -> None:
        """Tell long transients from motion that never settles, by how many survive, at two accuracies."""
        osc, means = self.osc, self.means
        watched = states[np.linspace(0, len(states) - 1, min(self._many, len(states))).astype(int)]
        reports, survivors = [], watched[:0]
        for carrier in (means.carrier, means.carrier.refined()):
            points = [attractor.points for attractor in self.attractors]
            survival, survivors, _ = watch(
                osc, watched, points, tolerance=self.tolerance, periods=_WATCH, stepper=carrier,
                executor=means.executor, progress=means.progress,
            )  # fmt: skip
            reports.append(survival)
        self.survival = tuple(reports)
        if reports[0].survivors and len(survivors):
            self._add_wandering(self._add_orbits(survivors, _LONGER_PERIOD))
        elif reports[0].survivors:
            self.words.append("What survived the coarser integration did not survive the finer, and is a transient.")

    def _add_wandering(self, survivors: Array) -> None:
        """Add the chaotic and quasiperiodic attractors that survivors are on."""
        if not len(survivors):
            return
        osc, finer = self.osc, self.means.carrier.refined()
        clouds = _clouds(osc, survivors, finer)
        for group in separate(clouds, _OVERLAP * self.tolerance):
            periods = _measuring_time(osc)
            few = survivors[group[: max(_LEAST_STARTS, _MEASURED * _LEAST_MEASURED // periods)]]
            carrier = self.means.exact if osc.barriers else finer  # without contacts to locate, steps do as well
            estimate = lyapunov_exponent(osc, few, carrier, periods=periods, executor=self.means.executor)
            kind = kind_of(estimate)
            if kind is None:
                self.words.append(
                    f"{len(group)} starts still approach an orbit of period over {_LONGER_PERIOD}, or one of which "
                    "the multipliers are close to 1; raise budget."
                )
                continue
            visits = np.concatenate([clouds[index] for index in group])
            sample = visits[:: -(-len(visits) // _SAMPLE)]
            self.attractors.append(describe_wandering(osc, kind, sample, estimate, self.survival, finer))


def _schedule(wait: int) -> list[int]:
    """Rounds of ever more periods, twice the wait together."""
    rounds, left, periods = [], 2 * wait, _FIRST_WAIT
    while left > 0:
        rounds.append(min(periods, left))
        left, periods = left - rounds[-1], 2 * periods
    return rounds


def _measuring_time(osc: Oscillator) -> int:
    """Periods in which motion that settles, however slowly, would be seen to: three e-foldings of the damping."""
    folds = osc.damping_ratio * osc.natural_frequency * osc.section_interval
    return _LEAST_MEASURED if folds == 0 else min(_WATCH, max(_LEAST_MEASURED, math.ceil(3 / folds)))


def _clouds(osc: Oscillator, states: Array, stepper: Stepper) -> list[Array]:
    """Points that each state visits, enough to fill a closed curve too."""
    visits = [states]
    for _ in range(_VISITS - 1):
        visits.append(run_ensemble(osc, Flow.STATE, stepper, visits[-1], 1).states)
    return list(np.array(visits).transpose(1, 0, 2))


def _on(orbit: Array, point: Array) -> bool:
    """Whether a point lies on a closed curve, as far as its samples tell."""
    spacing = np.linalg.norm(np.diff(orbit, axis=0), axis=1).max()
    return bool(np.linalg.norm(orbit - point[:2], axis=1).min() <= spacing)


def lasting_carrier(osc: Oscillator, attractors: Sequence[Attractor], carrier: Stepper, tolerance: float) -> Stepper:
    """Return a carrier, refined until every attractor is one for it too, or as often as is worth it."""
    for _ in range(_REFINEMENTS):
        if all(_persists(osc, attractor, carrier, tolerance) for attractor in attractors):
            break
        carrier = carrier.refined()
    return carrier


def _persists(osc: Oscillator, attractor: Attractor, carrier: Stepper, tolerance: float) -> bool:
    """Whether what starts on an attractor is on it after long."""
    states, periods = attractor.points[:1], 2000
    if attractor.kind == "limit cycle":
        (end,) = run_ensemble(osc, Flow.STATE, carrier, states, periods).states
        return _on(attractor.orbit, end)
    if attractor.repeats:
        known, periods = attractor.points, 512 * attractor.period
    else:
        known, states = attractor.points, attractor.points[:: max(1, len(attractor.points) // _WATCHED)]
    ends = run_ensemble(osc, Flow.STATE, carrier, states, periods).states[:, :2]
    distance = np.linalg.norm(ends[:, None] - known[None, :, :2], axis=2).min(axis=1)
    return bool(np.mean(distance <= 2 * tolerance) > 0.9)
