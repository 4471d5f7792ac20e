"""Saddles on the boundaries of basins: edge tracking finds them, Newton's method refines them."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import itertools
import math
from collections import defaultdict
from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import StructureError
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.single import record
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.progress import report, stage
from vibrokit.results.basins import UNSETTLED, Basins
from vibrokit.results.codes import Code
from vibrokit.results.finding import Finding
from vibrokit.results.saddle import Saddle
from vibrokit.structure.autonomous import PARTS_OF_A_TURN, Equilibrium, equilibria, refine_cycle
from vibrokit.structure.basins.classifier import BasinClassifier
from vibrokit.structure.basins.stop_cells import MARGIN
from vibrokit.structure.boundaries.chaotic_set import chaotic_set, growth
from vibrokit.structure.boundaries.edges import EdgeTrack, Straddles, meeting_cells
from vibrokit.structure.boundaries.returns import almost_repeats, closing, recurrence, same_place
from vibrokit.structure.boundaries.unstable import branch_limits, describe_unstable, refine_unstable
from vibrokit.structure.circle import shifted, turn_of, turns_to, wrapped
from vibrokit.structure.orbits import EQUAL
from vibrokit.structure.orbits_inside import orbits_inside
from vibrokit.symbolic.flow_kind import Flow

_LONGEST_PERIOD = 16
_CHECKED_EVERY = 4  # sections
_FARTHEST = 1e-2  # of the region's widths: largest distance from a motion to the orbit that it converges to
_NEAR = 1e-3  # of the region's widths: distance from a saddle within which a motion on the boundary converges to it
_FOLDS, _LONGEST_LEAVING = 15, 20_000  # e-foldings, and sections, of motion that leaves an equilibrium
_MOST_TRIES = 4
_FEW_POINTS = 12  # last points of a motion that must all be within that distance
_SAMPLES = 8192  # of a cycle
_SEVERAL = 32  # sections after which only a few motions go on for each pair of labels
_FEW, _FEWEST = 6, 2
_MANY_SECTIONS = 1_000_000  # that classifications took, after which even fewer go on; as many again after _SOON
_SOON = 128  # sections within which motions on most boundaries converge
_MOST = 128  # motions in all, where states settle within _QUICK sections; fewer where they need longer
_QUICK = 2000
_WATCHED = 64  # sections of a motion that has not settled
_LEAST_MOTIONS = 16
_ORBITS_INSIDE, _LONGEST_INSIDE = 8, 16  # unstable orbits inside a chaotic set, and their longest period
_RESIDUAL = 1e-10

Array = NDArray[np.float64]
Pair = tuple[int, int]


@dataclasses.dataclass(eq=False)
class SaddleSearch:
    """Finds the saddles on the boundaries between basins by edge tracking; an interrupt leaves those found so far.

    The classifier finds where states lead, and integrates those on the boundaries. The cells of the grid that lie
    `margin` cells inside a basin help it; a boundary on which no saddle is found is followed again without them. There
    are at most `trackers` motions for each pair of basins that meet, six after 32 sections, and two when classifying
    states has taken 10⁶ sections: near a chaotic edge state it takes long. A motion counts as one that does not repeat
    after `sections`, or earlier if classifying states has taken 10⁶ more since the 128th. No more than `budget`
    sections are taken to classify states, with the grid and without; boundaries without a saddle are not followed then.
    """

    plain: BasinClassifier
    basins: Basins
    orbit_stepper: Stepper
    trackers: int = 9
    sections: int = _SOON
    margin: int = MARGIN
    budget: float = math.inf

    def __post_init__(self) -> None:
        self.osc = self.plain.osc
        self.region = self.plain.region
        self._found: list[Saddle] = []
        self._places: list[Array] = []  # in units of the region's widths, as all points that are compared
        self._explained: set[Pair] = set()
        self._lost: tuple[Pair, ...] = ()
        self._findings: list[Finding] = []

    @functools.cached_property
    def classifier(self) -> BasinClassifier:
        """The one that uses the grid; where no basins meet, none is needed."""
        return self.plain.sharing(self.basins, self.margin)

    @property
    def saddles(self) -> tuple[Saddle, ...]:
        """The saddles, by period; then chaotic sets, and last the orbits inside these."""
        return tuple(sorted(self._found, key=lambda s: (s.embedded, s.kind == "chaotic", s.period, tuple(s.points[0]))))

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Findings about the saddles, and about boundaries without one."""
        orbits = [saddle for saddle in self._found if saddle.kind != "chaotic"]
        found = [Finding.of(Code.SADDLES, count=sum(not saddle.embedded for saddle in orbits)), *self._findings]
        found += [_on_boundary(Code.BOUNDARY_LOST, pair) for pair in self._lost]
        largest = max([saddle.displacement for saddle in orbits], default=0.0)
        if largest > _RESIDUAL:
            found.append(Finding.of(Code.LARGE_RESIDUAL, residual=largest, accepted=_RESIDUAL))
        return tuple(found)

    def run(self, rng: np.random.Generator) -> None:
        """Track the boundaries, the longest on the grid first."""
        meetings = meeting_cells(self.basins)
        most = max(_LEAST_MOTIONS, min(_MOST, _MOST * _QUICK // self.plain.budget))
        pairs = set(sorted(meetings, key=lambda pair: (-len(meetings[pair]), pair))[: most // 2])
        if len(meetings) > len(pairs):
            skipped = len(meetings) - len(pairs)
            self._findings.append(Finding.of(Code.BOUNDARIES_SKIPPED, skipped=skipped, total=len(meetings)))
        tracked, spent = 0, False
        with stage("saddles", unit="motions"):
            if self.osc.autonomous:
                self._add_equilibria()
            # Where motion only loses energy, all saddles are at rest; those over which it escapes may lie outside.
            known = {pair for pair in self._explained if min(pair) >= 0} if self.osc.model.relaxes else set()
            unexplained = pairs - known
            for shared in (True, False):
                if unexplained and not spent:
                    classifier = self.classifier if shared else self.plain
                    straddles = self._track(classifier, most, rng, unexplained, tracked)
                    self._look_into_strips(straddles)
                    tracked += len(straddles.origins)
                    spent = straddles.spent
                unexplained = pairs - self._explained
            # Motion on the boundary of one basin with another often ends at a saddle between the first and a third. So
            # boundaries that saddles do not connect are followed again, with all basins that they connect as one.
            found = -1
            while not spent and not self.osc.autonomous and found < len(self._found):
                found, groups = len(self._found), _groups(self._found)
                if not (apart := _apart(meetings, groups)):
                    break
                straddles = self._track(self.classifier, most, rng, apart, tracked, groups)
                tracked += len(straddles.origins)
                spent = straddles.spent
        if unexplained and spent:
            self._findings.append(Finding.of(Code.EDGE_BUDGET, count=len(unexplained), budget=self.budget))
        else:
            self._lost = tuple(sorted(unexplained))

    def _track(
        self,
        classifier: BasinClassifier,
        most: int,
        rng: np.random.Generator,
        only: set[Pair],
        tracked: int,
        groups: Mapping[int, int] | None = None,
    ) -> Straddles:
        """Follow motions on some boundaries, of basins taken as one where `groups` says so."""
        each = max(2, min(self.trackers, most // len(only)))
        straddles = self._straddles(classifier, each, rng, only, groups)
        self._follow(straddles, tracked)
        return straddles

    def _straddles(
        self,
        classifier: BasinClassifier,
        each: int,
        rng: np.random.Generator,
        only: set[Pair],
        groups: Mapping[int, int] | None = None,
    ) -> Straddles:
        """Start motions, and bring their sides together as often between two sections as they separate fast."""
        parts = 1
        while True:
            straddles = Straddles(
                classifier, self.basins, each, rng, only=only, parts=parts, budget=self.budget, groups=groups
            )
            for _ in range(straddles.parts):
                straddles.advance()
            if straddles.spent or not straddles.too_fast:
                return straddles
            parts *= 2

    def _add_equilibria(self) -> None:
        """Add those that one direction leaves, on both sides to different attractors.

        The cells of the grid do not help: a basin may be smaller than a cell.
        """
        for orbit in equilibria(self.osc, *self.region.bounds[0]):
            if np.sum(np.abs(orbit.multipliers) > 1) == 1:
                limits = branch_limits(self._patient(orbit), orbit)
                if len(set(limits)) > 1:
                    self._add(describe_unstable(self.osc, orbit, self.orbit_stepper, limits))
                    self._explained |= set(itertools.combinations(sorted(set(limits)), 2))

    def _patient(self, rest: Equilibrium) -> BasinClassifier:
        """The classifier with the sections that motion needs to leave an equilibrium in addition."""
        leaving = math.log(float(np.abs(rest.multipliers).max())) * PARTS_OF_A_TURN
        more = min(_LONGEST_LEAVING, math.ceil(_FOLDS / leaving))
        return dataclasses.replace(self.plain, budget=self.plain.budget + more)

    def _follow(self, straddles: Straddles, tracked: int) -> None:
        """Follow motions until each has converged to a saddle, or for the largest number of sections."""
        motions = len(straddles.origins)
        tries = np.zeros(motions, dtype=np.int64)
        parts, most_sections = straddles.parts, np.inf
        for step in range(1, self.sections * parts + 1):
            if not len(straddles) or straddles.spent or straddles.sections > most_sections:
                break
            if step > parts:  # the first section was for finding how many parts are needed
                straddles.advance()
            if step == _SOON * parts:
                most_sections = straddles.sections + _MANY_SECTIONS
            if step % (_CHECKED_EVERY * parts) == 0:
                arrived = np.array([self._arrived(straddles, n, tries) for n in range(len(straddles))], dtype=bool)
                self._explain(straddles, arrived)
                straddles.keep(~arrived)
            if step >= _SEVERAL * parts:
                most = _FEW if straddles.sections < _MANY_SECTIONS else _FEWEST
                straddles.keep(_first_few(straddles.end_labels, most))
            report(tracked + motions - len(straddles))
        if not straddles.spent:
            self._describe_wandering(straddles)
        report(tracked + motions)

    def _look_into_strips(self, straddles: Straddles) -> None:
        """Search for an orbit in a strip of states that do not settle, where the boundary cannot be followed."""
        strips = [strip for strip in straddles.strips if strip.labels not in self._explained]
        if not strips or self.osc.autonomous:
            return
        run = functools.partial(run_ensemble, self.osc, Flow.STATE, self.classifier.stepper)
        ended = run(np.array([strip.state for strip in strips]), self.classifier.budget)
        visits = run(ended.states, _WATCHED, visits=_WATCHED).visits
        for strip, points in zip(strips, visits, strict=True):
            period = recurrence(self.region.scaled(points), _LONGEST_PERIOD)
            with contextlib.suppress(StructureError):
                if period and self._reached_orbit(EdgeTrack(strip.labels, points, np.empty(0)), period):
                    self._explained.add(strip.labels)

    def _explain(self, straddles: Straddles, which: NDArray[np.bool_]) -> None:
        """Note the boundaries that lead to a saddle: between the labels there, and between the labels at the start."""
        both = np.concatenate([straddles.end_labels[which], straddles.origins[straddles.numbers[which]]])
        self._explained |= {(min(pair), max(pair)) for pair in both.tolist()}

    def _arrived(self, straddles: Straddles, index: int, tries: NDArray[np.int64]) -> bool:
        """Whether a motion has converged to a saddle, known or new."""
        track, number = straddles.track(index), straddles.numbers[index]
        points = self.region.scaled(track.points)
        if any(same_place(points[-_FEW_POINTS:], places, _NEAR) for places in self._places):
            return True
        autonomous = self.osc.autonomous
        if tries[number] == _MOST_TRIES and not autonomous:
            return False
        period = recurrence(points, 1 if autonomous else _LONGEST_PERIOD)
        try:
            if period:
                tries[number] += 1
                return self._reached_orbit(track, period)
            return autonomous and self._reached_cycle(track, straddles.interval)
        except StructureError:
            return False

    def _reached_orbit(self, track: EdgeTrack, period: int) -> bool:
        guess = track.guess(period)
        orbit, here = refine_unstable(self.osc, guess, period, self.orbit_stepper), np.atleast_2d(guess)[0]
        unstable = np.abs(orbit.multipliers).max() > 1
        if not unstable or self.region.apart(orbit.point, here) > _FARTHEST:
            return False
        point = wrapped(self.osc, orbit.point, self.plain.landings.middle) if self.plain.circle else orbit.point
        if any(same_place(self.region.scaled(point[None]), places, EQUAL) for places in self._places):
            return True
        limits = branch_limits(self.classifier, orbit)
        if len(set(limits)) < 2 or UNSETTLED in limits:
            limits = track.labels
        self._add(describe_unstable(self.osc, orbit, self.orbit_stepper, limits))
        return True

    def _reached_cycle(self, track: EdgeTrack, interval: float) -> bool:
        guess = closing(track.points, self.region.widths[0], interval)
        if guess is None:
            return False
        cycle = refine_cycle(self.osc, guess[0], guess[1], self.orbit_stepper)
        if self.region.apart(cycle.point, guess[0]) > _FARTHEST:
            return False
        if any(same_place(self.region.scaled(cycle.point[None]), places, _NEAR) for places in self._places):
            return True
        self._add(describe_unstable(self.osc, cycle, self.orbit_stepper, track.labels))
        spacing = cycle.duration / _SAMPLES
        cycle_points = record(self.osc, Flow.STATE, self.orbit_stepper, cycle.point, 0.0, spacing, _SAMPLES)
        self._places[-1] = self.region.scaled(cycle_points)
        return True

    def _add(self, saddle: Saddle) -> None:
        if self.plain.circle:
            saddle = _in_turn(self.osc, saddle, self.plain.landings.middle)
        self._found.append(saddle)
        self._places.append(self.region.scaled(saddle.points))

    def _describe_wandering(self, straddles: Straddles) -> None:
        """Describe the motions that converged to no orbit, those of each pair of labels together."""
        self._explain(straddles, np.ones(len(straddles), dtype=bool))
        tracks: defaultdict[Pair, list[EdgeTrack]] = defaultdict(list)
        for track in straddles.tracks():
            tracks[track.labels].append(track)
        for pair, motions in tracks.items():
            wandering = [motion for motion in motions if not self._repeats(motion.points)]
            if len(wandering) < len(motions):
                count = len(motions) - len(wandering)
                self._findings.append(_on_boundary(Code.MOTIONS_NOT_CONVERGED, pair, count=count))
            if wandering and not self.osc.autonomous:
                exponent, error = growth(wandering, self.osc.section_interval)
                chaotic = chaotic_set(wandering, exponent)
                self._found.append(chaotic)
                inside = self._add_orbits_inside(chaotic)
                self._findings.append(
                    _on_boundary(
                        Code.CHAOTIC_EDGE, pair, exponent=exponent, error=error, count=len(wandering), orbits=inside
                    )
                )  # fmt: skip
            elif wandering:
                self._findings.append(_on_boundary(Code.EDGE_NOT_CONVERGED, pair))

    def _add_orbits_inside(self, chaotic: Saddle) -> int:
        """Add unstable orbits inside a chaotic set on a boundary, and return their number.

        Those next to which all states lead to one attractor are left out: they do not lie on the boundary. So are
        those that are so unstable that rounding errors do not let them close.
        """
        before = len(self._found)
        for orbit in orbits_inside(self.osc, chaotic.points, self.orbit_stepper, _ORBITS_INSIDE, _LONGEST_INSIDE):
            limits = branch_limits(self.classifier, orbit)
            place = self.region.scaled(orbit.point[None])
            if len(set(limits)) > 1 and not any(same_place(place, places, EQUAL) for places in self._places):
                with contextlib.suppress(StructureError):  # Newton's method may lose it at its other points
                    described = describe_unstable(self.osc, orbit, self.orbit_stepper, limits)
                    if described.residual <= _RESIDUAL:
                        self._add(dataclasses.replace(described, embedded=True))
        return len(self._found) - before

    def _repeats(self, points: Array) -> bool:
        return almost_repeats(self.region.scaled(points), _FEW_POINTS, _LONGEST_PERIOD, _NEAR)


def _in_turn(osc: Oscillator, saddle: Saddle, middle: float) -> Saddle:
    """Return a saddle moved along x by whole turns, its points to the turn around a place."""
    away = -turn_of(osc) * float(turns_to(osc, saddle.points[:1], middle)[0])
    points = wrapped(osc, saddle.points, middle)
    return dataclasses.replace(
        saddle, points=points, nodes=shifted(saddle.nodes, away), orbit=shifted(saddle.orbit, away)
    )


def _on_boundary(code: Code, pair: Pair, **values: float) -> Finding:
    """Return a finding about the boundary between two basins; a side from which motion escapes is last."""
    first, second = pair if pair[0] >= 0 else pair[::-1]
    return Finding(code, first, second, values)


def _groups(saddles: Iterable[Saddle]) -> dict[int, int]:
    """Return, for each label of basins that saddles connect with others, the highest label of all of these."""
    groups: dict[int, int] = {}
    for saddle in saddles:
        joined = {groups.get(label, label) for label in saddle.leads_to}
        for label in [*saddle.leads_to, *(label for label, group in groups.items() if group in joined)]:
            groups[label] = max(joined)
    return groups


def _apart(pairs: Iterable[Pair], groups: Mapping[int, int]) -> set[Pair]:
    """Return the pairs of groups that meet, at least one of which has several basins."""
    large = set(groups.values())
    both = ((groups.get(first, first), groups.get(second, second)) for first, second in pairs)
    return {(min(pair), max(pair)) for pair in both if pair[0] != pair[1] and not large.isdisjoint(pair)}


def _first_few(labels: NDArray[np.int64], most: int) -> NDArray[np.bool_]:
    """Keep a few motions for each pair of labels."""
    seen: defaultdict[tuple[int, ...], int] = defaultdict(int)
    kept = np.zeros(len(labels), dtype=bool)
    for index, pair in enumerate(np.sort(labels, axis=1).tolist()):
        seen[tuple(pair)] += 1
        kept[index] = seen[tuple(pair)] <= most
    return kept
