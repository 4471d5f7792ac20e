"""Saddles on the boundaries of basins: edge tracking finds them, Newton's method refines them."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from collections import defaultdict
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import StructureError
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.single import record
from vibrokit.kernels.stepper import Stepper
from vibrokit.progress import report, stage
from vibrokit.results.basins import UNSETTLED, Basins
from vibrokit.results.codes import Code
from vibrokit.results.finding import Finding
from vibrokit.results.saddle import Saddle
from vibrokit.structure.along_x import wrapped
from vibrokit.structure.autonomous import PARTS_OF_A_TURN, equilibria, refine_cycle
from vibrokit.structure.basins.classifier import BasinClassifier
from vibrokit.structure.basins.stop_cells import MARGIN
from vibrokit.structure.boundaries.edges import EdgeTrack, Straddles, Strip
from vibrokit.structure.boundaries.meetings import Pair, first_few, groups_of, meeting_cells, pairs_apart
from vibrokit.structure.boundaries.motions import NEAR, almost_repeats, chaotic_set, closing, recurrence, same_place
from vibrokit.structure.boundaries.unstable import RESIDUAL, branch_limits, describe_unstable, in_turn, refine_unstable
from vibrokit.structure.orbits import EQUAL, LONGEST_PERIOD, Orbit
from vibrokit.structure.unstable_orbits import orbits_inside
from vibrokit.symbolic.flow_kind import Flow

SOON = 128
"""Sections within which motions on most boundaries converge."""
_FARTHEST = 1e-2  # of the region's widths: largest distance from a motion to the orbit that it converges to
_LAST = 12  # points of a motion that must all be near a saddle
_SHARE = 0.1  # of the budget: spent by then, only two motions go on between two labels, and motions count as wandering

Array = NDArray[np.float64]


@dataclasses.dataclass(eq=False)
class SaddleSearch:
    """Finds the saddles on the boundaries between basins by edge tracking; an interrupt leaves those found so far.

    The classifier finds where states lead, and integrates those on the boundaries. The cells of the grid that lie
    `margin` cells inside a basin help it; a boundary on which no saddle is found is followed again without them. No
    more than `budget` sections are taken to classify states, with the grid and without. There are at most `trackers`
    motions for each pair of basins that meet, six after 32 sections, and two when a tenth of the budget is spent: near
    a chaotic edge state classification takes long. A motion counts as one that does not repeat after `sections`, or
    earlier if classifying states has taken a tenth of the budget more since the 128th.
    """

    plain: BasinClassifier
    basins: Basins
    orbit_stepper: Stepper
    trackers: int = 9
    sections: int = SOON
    margin: int = MARGIN
    budget: float = 10**7

    def __post_init__(self) -> None:
        self.osc = self.plain.osc
        self.region = self.plain.region
        # Motions in all: fewer where states take long to settle.
        self.most = int(np.clip(self.budget // (39 * self.plain.budget), 16, 128))
        self.tracked, self.spent = 0, False
        self._found: list[Saddle] = []
        self._places: list[Array] = []  # in units of the region's widths, as all points that are compared
        self._explained: set[Pair] = set()
        self._lost: tuple[Pair, ...] = ()
        self._findings: list[Finding] = []

    @functools.cached_property
    def classifier(self) -> BasinClassifier:
        """The one that uses the grid."""
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
        large = [Finding.of(Code.LARGE_RESIDUAL, residual=largest, accepted=RESIDUAL)] if largest > RESIDUAL else []
        return (*found, *large)

    def run(self, rng: np.random.Generator) -> None:
        """Track the boundaries, the longest on the grid first."""
        meetings = meeting_cells(self.basins)
        pairs = set(sorted(meetings, key=lambda pair: (-len(meetings[pair]), pair))[: self.most // 2])
        if skipped := len(meetings) - len(pairs):
            self._findings.append(Finding.of(Code.BOUNDARIES_SKIPPED, skipped=skipped, total=len(meetings)))
        with stage("saddles", unit="motions"):
            if self.osc.autonomous:
                self._add_equilibria()
            # Where motion only loses energy, all saddles are at rest; those over which it escapes may lie outside.
            known = {pair for pair in self._explained if min(pair) >= 0} if self.osc.model.relaxes else set()
            unexplained = pairs - known
            for shared in (True, False):
                if unexplained and not self.spent:
                    self._track(self.classifier if shared else self.plain, rng, unexplained)
                unexplained = pairs - self._explained
            # Motion on the boundary of one basin with another often ends at a saddle between the first and a third. So
            # boundaries that saddles do not connect are followed again, with all basins that they connect as one.
            found = -1
            while not self.spent and not self.osc.autonomous and found < len(self._found):
                found, groups = len(self._found), groups_of(self._found)
                if apart := pairs_apart(meetings, groups):
                    self._track(self.classifier, rng, apart, groups)
        if unexplained and self.spent:
            self._findings.append(Finding.of(Code.EDGE_BUDGET, count=len(unexplained), budget=self.budget))
        else:
            self._lost = tuple(sorted(unexplained))

    def _track(
        self,
        classifier: BasinClassifier,
        rng: np.random.Generator,
        only: set[Pair],
        groups: Mapping[int, int] | None = None,
    ) -> None:
        """Follow motions on some boundaries, of basins taken as one where `groups` says so."""
        each, parts = max(2, min(self.trackers, self.most // len(only))), 1
        while True:  # sides that separate fast are brought together more often between two sections
            straddles = Straddles(classifier, self.basins, each, rng, only, parts, self.budget, groups)
            for _ in range(straddles.parts):
                straddles.advance()
            if straddles.spent or not straddles.too_fast:
                break
            parts *= 2
        self._follow(straddles)
        if groups is None and not self.osc.autonomous:
            self._look_into([strip for strip in straddles.strips if strip.labels not in self._explained])
        self.tracked += len(straddles.origins)
        self.spent = straddles.spent

    def _add_equilibria(self) -> None:
        """Add those that one direction leaves to different attractors; a basin may be smaller than a cell."""
        for orbit in equilibria(self.osc, *self.region.bounds[0].tolist()):
            if np.sum(np.abs(orbit.multipliers) > 1) == 1:
                # The sections that motion needs to leave the equilibrium, 15 e-foldings, come on top.
                growth = math.log(float(np.abs(orbit.multipliers).max())) * PARTS_OF_A_TURN
                budget = self.plain.budget + min(20_000, math.ceil(15 / growth))
                limits = branch_limits(dataclasses.replace(self.plain, budget=budget), orbit)
                if len(set(limits)) > 1:
                    self._add(orbit, limits)
                    self._explained |= set(itertools.combinations(sorted(set(limits)), 2))

    def _follow(self, straddles: Straddles) -> None:
        """Follow motions until each has converged to a saddle, or for the largest number of sections."""
        motions, parts = len(straddles.origins), straddles.parts
        tries = np.zeros(motions, dtype=np.int64)
        most_sections = math.inf
        for step in range(1, self.sections * parts + 1):
            if not len(straddles) or straddles.spent or straddles.sections > most_sections:
                break
            if step > parts:  # the first section was for finding how many parts are needed
                straddles.advance()
            if step == SOON * parts:
                most_sections = straddles.sections + _SHARE * self.budget
            if step % (4 * parts) == 0:
                arrived = np.array([self._arrived(straddles, n, tries) for n in range(len(straddles))], dtype=bool)
                self._explain(straddles, arrived)
                straddles.keep(~arrived)
            if step >= 32 * parts:
                straddles.keep(first_few(straddles.end_labels, 6 if straddles.sections < _SHARE * self.budget else 2))
            report(self.tracked + motions - len(straddles))
        if not straddles.spent:
            self._describe_wandering(straddles)
        report(self.tracked + motions)

    def _look_into(self, strips: Sequence[Strip]) -> None:
        """Search for an orbit in strips of states that do not settle, where the boundary cannot be followed."""
        if not strips:
            return
        run = functools.partial(run_ensemble, self.osc, Flow.STATE, self.classifier.stepper)
        ended = run(np.array([strip.state for strip in strips]), self.classifier.budget)
        visits = run(ended.states, 64, visits=64).visits
        for strip, points in zip(strips, visits, strict=True):
            period = recurrence(self.region.scaled(points), LONGEST_PERIOD)
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
        if self._known(points[-_LAST:], NEAR):
            return True
        if self.osc.autonomous:
            rests = recurrence(points, 1)
            return self._reached_orbit(track, 1) if rests else self._reached_cycle(track, straddles.interval)
        period = recurrence(points, LONGEST_PERIOD) if tries[number] < 4 else 0
        tries[number] += period > 0
        return period > 0 and self._reached_orbit(track, period)

    def _reached_orbit(self, track: EdgeTrack, period: int) -> bool:
        guess = track.guess(period)
        try:
            orbit = refine_unstable(self.osc, guess, period, self.orbit_stepper)
        except StructureError:
            return False
        unstable = np.abs(orbit.multipliers).max() > 1
        if not unstable or self.region.apart(orbit.point, np.atleast_2d(guess)[0]) > _FARTHEST:
            return False
        point = wrapped(self.osc, orbit.point, self.plain.landings.middle) if self.plain.circle else orbit.point
        if self._known(self.region.scaled(point[None]), EQUAL):
            return True
        limits = branch_limits(self.classifier, orbit)
        return self._add(orbit, track.labels if len(set(limits)) < 2 or UNSETTLED in limits else limits)

    def _reached_cycle(self, track: EdgeTrack, interval: float) -> bool:
        guess = closing(track.points, self.region.widths[0], interval)
        try:
            cycle = refine_cycle(self.osc, *guess, self.orbit_stepper) if guess else None
        except StructureError:
            return False
        if guess is None or cycle is None or self.region.apart(cycle.point, guess[0]) > _FARTHEST:
            return False
        if not self._known(self.region.scaled(cycle.point[None]), NEAR) and self._add(cycle, track.labels):
            count = 8192
            path = record(self.osc, Flow.STATE, self.orbit_stepper, cycle.point, 0.0, cycle.duration / count, count)
            self._places[-1] = self.region.scaled(path)
        return True

    def _known(self, points: Array, distance: float) -> bool:
        return any(same_place(points, places, distance) for places in self._places)

    def _add(self, orbit: Orbit, limits: tuple[int, ...], *, embedded: bool = False) -> bool:
        """Describe and add a saddle; return whether it was: an embedded one must close up to rounding errors."""
        try:  # Newton's method may lose it at its other points
            saddle = describe_unstable(self.osc, orbit, self.orbit_stepper, limits)
        except StructureError:
            return False
        if embedded and not saddle.residual <= RESIDUAL:
            return False
        saddle = dataclasses.replace(saddle, embedded=embedded)
        self._found.append(in_turn(self.osc, saddle, self.plain.landings.middle) if self.plain.circle else saddle)
        self._places.append(self.region.scaled(self._found[-1].points))
        return True

    def _describe_wandering(self, straddles: Straddles) -> None:
        """Describe the motions that converged to no orbit, those of each pair of labels together."""
        self._explain(straddles, np.ones(len(straddles), dtype=bool))
        tracks: defaultdict[Pair, list[EdgeTrack]] = defaultdict(list)
        for track in map(straddles.track, range(len(straddles))):
            tracks[track.labels].append(track)
        for pair, motions in tracks.items():
            scaled = [self.region.scaled(motion.points) for motion in motions]
            repeating = [almost_repeats(points, _LAST, LONGEST_PERIOD) for points in scaled]
            wandering = list(itertools.compress(motions, np.logical_not(repeating)))
            if any(repeating):
                self._findings.append(_on_boundary(Code.MOTIONS_NOT_CONVERGED, pair, count=sum(repeating)))
            if wandering and not self.osc.autonomous:
                chaotic, error = chaotic_set(wandering, self.osc.section_interval)
                self._found.append(chaotic)
                counts = {"count": len(wandering), "orbits": self._add_orbits_inside(chaotic)}
                exponent = float(chaotic.exponents[0].real)
                self._findings.append(_on_boundary(Code.CHAOTIC_EDGE, pair, exponent=exponent, error=error, **counts))
            elif wandering:
                self._findings.append(_on_boundary(Code.EDGE_NOT_CONVERGED, pair))

    def _add_orbits_inside(self, chaotic: Saddle) -> int:
        """Add unstable orbits inside a chaotic set on a boundary, and return their number.

        Those next to which all states lead to one attractor do not lie on the boundary.
        """
        before = len(self._found)
        for orbit in orbits_inside(self.osc, chaotic.points, self.orbit_stepper, 8, LONGEST_PERIOD):
            limits = branch_limits(self.classifier, orbit)
            if len(set(limits)) > 1 and not self._known(self.region.scaled(orbit.point[None]), EQUAL):
                self._add(orbit, limits, embedded=True)
        return len(self._found) - before


def _on_boundary(code: Code, pair: Pair, **values: float) -> Finding:
    """Return a finding about the boundary between two basins; a side from which motion escapes is last."""
    first, second = pair if pair[0] >= 0 else pair[::-1]
    return Finding(code, first, second, values)
