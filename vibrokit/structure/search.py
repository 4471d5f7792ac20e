"""The search for attractors: starts are followed until they recur; the others are followed for a long time."""

from __future__ import annotations

import concurrent.futures
import dataclasses
import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import StructureError
from vibrokit.kernels.ensemble import Stop, run_ensemble
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.progress import report, stage
from vibrokit.results.attractor import Attractor, Survival
from vibrokit.results.basins import ESCAPED, NOT_FOLLOWED, UNSETTLED
from vibrokit.results.codes import Code
from vibrokit.results.finding import Finding
from vibrokit.results.region import Region
from vibrokit.structure.along_x import shifted, turn_of, wrapped
from vibrokit.structure.attractors.describe import describe_orbit, describe_wandering, is_cycle
from vibrokit.structure.attractors.wandering import follow, kind_of, lyapunov_exponent, separate, watch
from vibrokit.structure.autonomous import Equilibrium, equilibria, find_cycle
from vibrokit.structure.basins.stop_cells import wells
from vibrokit.structure.known_motions import known_motions
from vibrokit.structure.neutral import is_neutral
from vibrokit.structure.orbits import EQUAL, LONGEST_PERIOD, arrival_at, least_period, refine_orbit, same_point, visited
from vibrokit.structure.persistence import is_on_cycle
from vibrokit.structure.scales import length_of, units_of
from vibrokit.symbolic.flow_kind import Flow

_LONGER_PERIOD = 256  # of orbits that are searched for among starts that settle slowly
_NEAR = 1e-3  # distance, relative to the motion, between an orbit and its approximation by a coarse stepper
_LOOSE = 1e-2  # the same, of recurrences from which Newton's method is tried

Array = NDArray[np.float64]


@dataclasses.dataclass(eq=False)
class Search:
    """Finds the steady states of a scene, one after another; an interrupt leaves those found so far."""

    osc: Oscillator
    region: Region
    settling: float  # distance at which a state counts as settled on a known orbit, as a part of the region's widths
    stepper: Stepper  # of ensembles
    orbit_stepper: Stepper
    executor: concurrent.futures.Executor | None

    def __post_init__(self) -> None:
        self.distances = self.settling * self.region.widths  # (2,) in x and v
        self.attractors: list[Attractor] = []
        self.at_rest: tuple[Equilibrium, ...] = ()  # by position
        self.survival: tuple[Survival, ...] = ()
        self.starts = self.diverged = self.stalled = 0  # stalled: they need too many steps in a section interval
        self.unsettled = np.empty((0, 2))  # states of the starts that have not settled, after so many periods
        self.periods = 0
        self.neutral = 0  # starts that have settled on motions of families, which are no attractors
        self.long_motion: list[Finding] = []
        self.beyond = {"followed": 0, "diverged": 0, "moving": 0}  # motions that were followed on, and how these ended

    def run(self, states: Array, wait: int, patient: bool) -> None:
        """Follow the states (count, n) until each recurs, diverges, or has not settled for a long time.

        Some settle slowly, so that starts are followed for twice `wait`, the periods that a transient is given. Unless
        that is as long as the damping requires (`patient`), motion that goes on while nothing has settled is no
        evidence of an attractor.
        """
        self.starts, self.unsettled = len(states), states
        with stage("attractors", unit="starts", total=self.starts):
            if self.osc.autonomous:  # then starts need not be followed until they rest, which is long on stiff stops
                self.add_rests(*self.region.x)
            else:
                for start in known_motions(self.osc, self.region, length_of(self.osc)):
                    self._add_orbit(start, 1)
            for periods in _rounds(wait):
                states = self.unsettled = self._add_orbits(self._after(states, periods), LONGEST_PERIOD)
                report(self.starts - len(states))
                if not len(states):
                    return
            if self.osc.autonomous:
                if unsettled := len(self._add_cycles(states)):
                    self.long_motion.append(Finding.of(Code.STARTS_UNSETTLED, count=unsettled))
            elif patient or self.attractors:
                self._watch(states)
            report(self.starts)

    def add_rests(self, low: float, high: float) -> bool:
        """Add the stable equilibria between two places (m); return whether some were not known."""
        known = len(self.attractors)
        self.at_rest = equilibria(self.osc, low, high)
        for rest in self.at_rest:
            self._add_orbit(rest.point, 1)
        return len(self.attractors) > known

    def go_on(self, states: Array, wait: int) -> bool:
        """Follow more states; return whether some come to an attractor that was not known."""
        known, counts, followed = len(self.attractors), (self.diverged, self.stalled, self.neutral), len(states)
        if followed:
            states = self._add_orbits(self._after(states, wait), LONGEST_PERIOD)
        if self.osc.autonomous:
            states = self._add_cycles(states)
        gone, moving = self.diverged - counts[0], len(states) + self.stalled - counts[1]
        followed -= self.neutral - counts[2]  # the starts have told of families
        self.diverged, self.stalled, self.neutral = counts
        self.beyond = {"followed": followed, "diverged": gone, "moving": moving}
        return len(self.attractors) > known

    @property
    def progress(self) -> Finding:
        """What the starts were doing after the last round."""
        moving = int(self.region.contains(self.unsettled[:, :2]).sum())
        settled = self.starts - self.diverged - self.stalled - len(self.unsettled)
        return Finding.of(
            Code.SEARCH_STOPPED, starts=self.starts, periods=self.periods, settled=settled, moving=moving,
            left=len(self.unsettled) - moving, diverged=self.diverged,
        )  # fmt: skip

    @property
    def endings(self) -> list[Finding]:
        """Findings about the starts and the lost cells that came to no attractor."""
        found = []
        if self.diverged and (where := self.osc.model.conditions):
            found.append(Finding.of(Code.STARTS_ENDED, count=self.diverged, starts=self.starts, where=where))
        elif self.diverged:
            found.append(Finding.of(Code.STARTS_DIVERGED, count=self.diverged, starts=self.starts))
        if self.neutral:
            found.append(Finding.of(Code.STARTS_NEUTRAL, count=self.neutral, starts=self.starts))
        if self.stalled:
            found.append(Finding.of(Code.STARTS_STALLED, count=self.stalled, starts=self.starts))
        if followed := self.beyond["followed"]:
            settled = followed - self.beyond["diverged"] - self.beyond["moving"]
            found.append(Finding.of(Code.FOLLOWED_ON, settled=settled, **self.beyond))
        return found

    @property
    def findings(self) -> list[Finding]:
        """Findings about motion that goes on for long."""
        names = ("periods", "stepper", "survivors", "starts", "lifetime", "lifetime_error")
        survivals = [{name: getattr(one, name) for name in names} for one in self.survival]
        return [*self.long_motion, *(Finding.of(Code.SURVIVAL, **values) for values in survivals)]

    def failure(self, budget: int, wait: int) -> str:
        """Return why nothing was found, and what to change; `wait` is the budget that the damping requires."""
        advice = "raise budget" if budget < wait else "widen the region or raise budget"
        if self.diverged > self.starts / 2:
            where = self.osc.model.conditions
            ended = f"end where the forces do ({where})" if where else "grow without bound"
            advice = f"most motions {ended}; narrow the region, or check the signs of the forces"
        if self.neutral > self.starts / 2:
            advice = (
                f"{self.neutral} settle at places that no force determines, on motions that attract none beside them; "
                "give the scene a spring, or a force that presses the mass to a stop"
            )
        if self.stalled > self.starts / 2:
            advice = f"{self.stalled} need too many steps; take softer laws, or friction that is smoother"
        return (
            f"no steady state was found from {self.starts} starts in x ∈ {self.region.x}, v ∈ {self.region.v}: within "
            f"{budget} periods no start reached an orbit of period up to {LONGEST_PERIOD} or a set that persists, and "
            f"{self.diverged} diverged; {advice}."
        )

    def _arrival(self) -> Stop:
        """The test for having reached a known attractor, or a state from which motion cannot leave the well of one."""
        copies = [known.points for known in self.attractors]
        if turn := turn_of(self.osc):  # at the ends of a turn, motion is near the copies in the turns beside it
            copies = [np.concatenate([shifted(points, away) for away in (-turn, 0.0, turn)]) for points in copies]
        reached = arrival_at(dict(enumerate(copies)), self.distances)
        trapped = wells(self.osc, self.attractors, self.region)
        return reached if trapped is None else reached.or_in_cells(trapped.region.bounds, trapped.labels)

    def _after(self, states: Array, periods: int) -> Array:
        """Return the states some periods later, without those that reached a known orbit, diverged or stalled.

        Motion to infinity in a finite time needs too many steps too, outside the region. The first periods are followed
        in short stretches, so that work that is stopped can tell what the starts were doing.
        """
        arrival, end = self._arrival(), self.periods + periods
        while self.periods < end:
            stretch = min(max(1, 3 * self.periods), end - self.periods)
            ended, _, labels = follow(self.osc, states, arrival, stretch, self.stepper, self.executor)
            stalled = (labels == NOT_FOLLOWED) & self.region.contains(ended[:, :2])
            self.stalled += int(np.sum(stalled))
            self.diverged += int(np.sum(np.isin(labels, (ESCAPED, NOT_FOLLOWED)) & ~stalled))
            states = self.unsettled = ended[labels == UNSETTLED]
            self.periods += stretch
        return states

    def _known(self, point: Array, tolerance: float) -> bool:
        return any(same_point(self.osc, point, known.points, tolerance) for known in self.attractors if known.repeats)

    def _add_orbits(self, states: Array, longest: int) -> Array:
        """Add the new stable orbits that states lie on; return the states that lie on none."""
        path = _section_path(self.osc, states, self.stepper, longest)
        sizes = units_of(self.osc) + np.abs(wrapped(self.osc, path)).max(axis=0)
        distance = np.linalg.norm(wrapped(self.osc, path[1:] - path[0]) / sizes, axis=2)
        close = distance < 1e-5
        settled = close.any(axis=0)
        for index in np.flatnonzero(settled):
            period = int(np.argmax(close[:, index])) + 1
            settled[index] = self._known(path[0, index], _NEAR) or self._add_orbit(path[0, index], period)
            self.neutral += bool(settled[index]) and not self._known(path[0, index], _NEAR)
        self._guess(path[:, ~settled], distance[:, ~settled])
        return path[0, ~settled]

    def _guess(self, path: Array, distance: Array) -> None:
        """Try Newton's method where the motion nearly recurs: an orbit known early saves following starts to it."""
        tried = 0
        for index in np.argsort(distance.min(axis=0)):
            nearest = float(distance[:, index].min())
            if tried == 8 or nearest > _LOOSE:
                return
            if not self._known(path[0, index], _LOOSE):
                self._add_orbit(path[0, index], int(np.argmin(distance[:, index])) + 1)
                tried += 1

    def _add_orbit(self, point: Array, period: int) -> bool:
        """Add the orbit through a point that recurs, if it is new; return whether the point has settled on it."""
        stepper = self.orbit_stepper
        try:
            orbit = least_period(self.osc, refine_orbit(self.osc, point, period, stepper), stepper)
        except StructureError:
            return False
        neutral = is_neutral(orbit.multipliers)
        if np.abs(orbit.multipliers).max() >= 1 and not neutral:
            return False  # the motion passes near a saddle
        points = visited(self.osc, orbit, stepper)
        if not same_point(self.osc, point, points, 0.1):
            return False  # Newton's method went far away
        if is_cycle(self.osc, orbit, stepper):
            return False  # its own duration is unknown here; see `_add_cycles`
        if not neutral and not self._known(orbit.point, EQUAL):
            self.attractors.append(describe_orbit(self.osc, orbit, stepper))
        return same_point(self.osc, point, points, _NEAR)

    def _add_cycles(self, states: Array) -> Array:
        """Add the limit cycles that states lie on, until eight lie on none; return the states that lie on none."""
        failures = 0
        for state in states:
            if failures < 8 and not self._on_cycle(state):
                failures += not self._add_cycle(state)
        return states[[not self._on_cycle(state) for state in states]]

    def _on_cycle(self, state: Array) -> bool:
        return any(is_on_cycle(self.osc, known, state) for known in self.attractors if known.kind == "limit cycle")

    def _add_cycle(self, state: Array) -> bool:
        """Add the limit cycle that a state lies on, if it is new; return whether there is a stable one."""
        try:
            longest = 50 * self.osc.section_interval
            cycle = find_cycle(self.osc, state, self.orbit_stepper, longest=longest)
        except StructureError:
            return False
        along = int(np.argmin(np.abs(cycle.multipliers - 1.0)))  # 1, up to rounding: that of a shift in time
        if np.abs(np.delete(cycle.multipliers, along)).max() >= 1:
            return False
        if not self._on_cycle(cycle.point):
            self.attractors.append(describe_orbit(self.osc, cycle, self.orbit_stepper))
        return True

    def _watch(self, states: Array) -> None:
        """Distinguish long transients from motion that never settles, by its survival at two accuracies."""
        watched = states[np.linspace(0, len(states) - 1, min(64, len(states))).astype(int)]
        survivors = watched[:0]
        for stepper in (self.stepper, self.stepper.refined()):
            survival, survivors = watch(self.osc, watched, self._arrival(), stepper, executor=self.executor)
            self.survival = (*self.survival, survival)
        if self.survival[0].survivors and len(survivors):
            self._add_wandering(self._add_orbits(survivors, _LONGER_PERIOD))
        elif self.survival[0].survivors:
            self.long_motion.append(Finding.of(Code.CHAOTIC_TRANSIENT))

    def _add_wandering(self, survivors: Array) -> None:
        """Add the chaotic and quasiperiodic attractors that survivors are on."""
        if not len(survivors):
            return
        osc, finer = self.osc, self.stepper.refined()
        clouds = list(wrapped(osc, _section_path(osc, survivors, finer, 2047)).transpose(1, 0, 2))
        for group in separate([cloud[:, :2] / self.distances for cloud in clouds], 4.0):
            periods = _measuring_time(osc)
            few = survivors[group[: max(4, 16_000 // periods)]]
            stepper = self.orbit_stepper if osc.barriers else finer  # without contacts fixed steps are as accurate
            estimate = lyapunov_exponent(osc, few, stepper, periods=periods, executor=self.executor)
            kind = kind_of(estimate)
            if kind is None:
                self.long_motion.append(Finding.of(Code.SLOW_SETTLING, count=len(group), period=_LONGER_PERIOD))
                continue
            visits = np.concatenate([clouds[index] for index in group])
            sample = visits[:: -(-len(visits) // 4096)]
            self.attractors.append(describe_wandering(osc, kind, sample, estimate, self.survival, finer))


def _rounds(wait: int) -> Iterator[int]:
    """Periods of each round, which double from 64; twice the wait together."""
    remaining, periods = 2 * wait, 64
    while remaining > 0:
        yield min(periods, remaining)
        remaining, periods = remaining - periods, 2 * periods


def _measuring_time(osc: Oscillator) -> int:
    """Periods in which motion that settles, however slowly, shows it: three e-foldings of the damping."""
    folds = 0.5 * osc.linear_damping * osc.section_interval
    return 1000 if folds == 0 else min(20_000, max(1000, math.ceil(3 / folds)))


def _section_path(osc: Oscillator, states: Array, stepper: Stepper, sections: int) -> Array:
    """Return states (count, n) and their images over some sections, shape (sections + 1, count, n)."""
    visits = [states]
    for _ in range(sections):
        visits.append(run_ensemble(osc, Flow.STATE, stepper, visits[-1], 1).states)
    return np.array(visits)
