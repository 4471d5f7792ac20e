"""Joins the steady states at neighbouring values of a parameter into branches, with names and bifurcations."""

from __future__ import annotations

import dataclasses
import itertools
import math
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree

from vibrokit.errors import StructureError, VibrokitError
from vibrokit.progress import advance, stage
from vibrokit.results.attractor import Attractor
from vibrokit.results.codes import Code
from vibrokit.results.continuation import GRAZING, Bifurcation
from vibrokit.results.finding import Finding
from vibrokit.structure.attractors.describe import describe_orbit
from vibrokit.structure.attractors.names import branch_names_of
from vibrokit.structure.autonomous import Cycle
from vibrokit.structure.linear_map import linear_map
from vibrokit.structure.orbits import SAMPLES, Orbit, refine_orbit, visited
from vibrokit.structure.tracing.bifurcations import Located
from vibrokit.structure.tracing.families import DOUBLING, Member
from vibrokit.structure.tracing.following import Follower

_NEAR = 0.1  # fraction of the region's size within which two sets of points may belong to one branch

Array = NDArray[np.float64]
Place = tuple[int, int]
"""A value, by its index, and an attractor there, by its index."""


@dataclasses.dataclass(eq=False)
class Tracing:
    """Steady states at each value, the links between neighbouring values, and the bifurcations between."""

    follower: Follower
    values: list[float]  # those with steady states, ascending
    found: list[list[Attractor]]  # at each; those that the search missed are added, with basin fraction NaN

    def __post_init__(self) -> None:
        self.at, self.size, self.stepper = self.follower.at, self.follower.size, self.follower.stepper
        self.links: list[dict[int, int]] = [{} for _ in self.values[1:]]
        self.located: list[tuple[Place, Located]] = []
        self.added = 0
        self._led_to: dict[tuple[int, int, int], Array] = {}

    def run(self) -> None:
        """Follow every orbit to the next value, those that were not reached back, and pair the others by distance."""
        pairs = range(len(self.links))
        with stage("branches", unit="intervals", total=3 * len(pairs)):
            for pair in pairs:
                for index in range(len(self.found[pair])):
                    self._follow(pair, index, pair + 1)
                advance()
            for pair in reversed(pairs):
                for index in range(len(self.found[pair + 1])):
                    if index not in self.links[pair].values():
                        self._follow(pair + 1, index, pair)
                advance()
            self.pair_off()
            for pair in pairs:
                for first, second in self.links[pair].items():
                    self._find_parents(pair, first, second)
                advance()

    def pair_off(self) -> None:
        """Join what no family has joined by the distances between the sets of points, which is fast."""
        for pair in range(len(self.links)):
            self._pair_off(pair)

    @cached_property
    def numbered(self) -> list[list[int]]:
        """The branch of every attractor, value by value, once all are joined; they are numbered as they appear."""
        branches: list[list[int]] = []
        count = 0
        for at, attractors in enumerate(self.found):
            back = {second: first for first, second in self.links[at - 1].items()} if at else {}
            own = []
            for index in range(len(attractors)):
                own.append(branches[at - 1][back[index]] if index in back else count)
                count += index not in back
            branches.append(own)
        return branches

    def _follow(self, at: int, index: int, to: int) -> None:
        attractor, start, target = self.found[at][index], self.values[at], self.values[to]
        if not attractor.repeats or (attractor.turns and self.follower.osc.autonomous):
            return
        try:
            followed = self.follower.follow(attractor, start, target)
        except VibrokitError:  # it stays unlinked, and a finding says that its branch ends
            return
        self.located += [((at, index), bifurcation) for bifurcation in followed.bifurcations]
        end = followed.end
        if end is None:
            return
        other = self._known(attractor, end, to)
        if other is None and followed.stable:
            other = self._add(attractor, end, to)
        if other is None:
            osc = self.at(end.value)
            orbit = Orbit(end.point[None], attractor.period, end.duration, end.derivative[None], end.residual)
            self._led_to[at, index, to] = visited(osc, orbit, self.stepper)
            return
        first, second, pair = (index, other, at) if to > at else (other, index, to)
        if first not in self.links[pair] and second not in self.links[pair].values():
            self.links[pair][first] = second

    def _known(self, origin: Attractor, member: Member, at: int) -> int | None:
        """Return the known attractor that a member of the family of an attractor is, if it is one."""
        for index, attractor in enumerate(self.found[at]):
            if (attractor.kind, attractor.period) == (origin.kind, origin.period):
                away = np.abs(attractor.points[:, :2] - member.point[:2]) / self.size
                if away.max(axis=1).min() < 1e-5:
                    return index
        return None

    def _add(self, origin: Attractor, member: Member, at: int) -> int | None:
        """Add a member of the family of an attractor; return its index, or None if it cannot be described."""
        osc, period = self.at(self.values[at]), origin.period
        try:
            if origin.kind == "limit cycle":
                orbit: Orbit = Cycle(member.point[None], 1, member.duration, member.derivative[None], member.residual)
            else:
                point, duration = member.point[None], period * osc.section_interval
                steps = linear_map(osc, point, self.stepper, intervals=period).derivatives
                orbit = Orbit(point, period, duration, steps, member.residual)
            attractor = describe_orbit(osc, orbit, self.stepper)
        except VibrokitError:
            return None
        self.found[at].append(without_fraction(attractor))
        self.added += 1
        return len(self.found[at]) - 1

    def _pair_off(self, pair: int) -> None:
        """Join by the smallest sum of distances between the sets of points, except for those that are too far apart."""
        first, second = self.found[pair], self.found[pair + 1]
        costs = np.full((len(first), len(second)), 2 * _NEAR)
        for row, before in enumerate(first):
            for column, after in enumerate(second):
                if before.repeats and after.repeats and not _doubled(before.period, after.period):
                    continue
                here = self._led_to.get((pair, row, pair + 1), before.points)
                there = self._led_to.get((pair + 1, column, pair), after.points)
                away = min(_apart(here, after.points, self.size), _apart(before.points, there, self.size))
                costs[row, column] = min(away, 2 * _NEAR)
        for row, column in self.links[pair].items():
            costs[row, column] = -1.0  # one family joins them
        for row, column in zip(*linear_sum_assignment(costs), strict=True):
            if costs[row, column] < _NEAR:
                self.links[pair].setdefault(int(row), int(column))

    def _find_parents(self, pair: int, first: int, second: int) -> None:
        """Between orbits whose periods differ by a power of two, follow those of the periods between back."""
        few, many = (pair, first), (pair + 1, second)
        if self.found[pair][first].period > self.found[pair + 1][second].period:
            few, many = many, few
        small, large = self.found[few[0]][few[1]], self.found[many[0]][many[1]]
        if {small.kind, large.kind} != {"periodic"} or large.period % small.period:
            return
        start, target = self.values[many[0]], self.values[few[0]]
        period = large.period // 2
        while period > small.period and period % 2 == 0:
            try:
                guess = large.points[::period].mean(axis=0)
                orbit = refine_orbit(self.at(start), guess, period, self.stepper)
                parent = dataclasses.replace(large, points=orbit.point[None], period=period)
                passed = self.follower.follow(parent, start, target).bifurcations
            except VibrokitError:
                return
            self.located += [(many, found) for found in passed if found.kind == DOUBLING]
            period //= 2

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the branches."""
        members: dict[int, list[Attractor]] = {}
        for attractors, branches in zip(self.found, self.numbered, strict=True):
            for attractor, branch in zip(attractors, branches, strict=True):
                members.setdefault(branch, []).append(attractor)
        own = [members[branch] for branch in sorted(members)]
        return branch_names_of(own, has_stops=bool(self.follower.osc.barriers))

    @cached_property
    def bifurcations(self) -> tuple[Bifurcation, ...]:
        """Each bifurcation once, the most accurate if it was located from both sides."""
        kept: list[tuple[Place, Located]] = []
        for place, found in sorted(self.located, key=lambda one: one[1].error):
            if not any(self._same(found, known) for _, known in kept):
                kept.append((place, found))
        kept.sort(key=lambda one: (one[1].value, one[1].kind))
        return tuple(
            Bifurcation(one.kind, one.value, one.error, self.numbered[at][index], one.period, one.point, one.side)
            for (at, index), one in kept
        )

    def _same(self, one: Located, other: Located) -> bool:
        if (one.kind, one.period, one.side) != (other.kind, other.period, other.side):
            return False
        span = abs(self.values[-1] - self.values[0])
        if abs(one.value - other.value) > 1e-7 * span + one.error + other.error:
            return False
        points = other.point[None]
        if other.period > 1:  # they may have different points of the orbit
            osc = self.at(other.value)
            try:
                points = visited(osc, refine_orbit(osc, other.point, other.period, self.stepper), self.stepper)
            except StructureError:
                return True
        away = np.abs(points[:, :2] - one.point[:2]) / self.size
        return bool(away.max(axis=1).min() < 1e-3) or one.bracketed or other.bracketed

    def findings(self, values: int) -> tuple[Finding, ...]:
        """Return findings about the branches at some number of values."""
        count = len({branch for branches in self.numbered for branch in branches})
        found = [Finding.of(Code.BRANCHES, branches=count, values=values, parameter=self.follower.line.path)]
        found += [
            Finding.of(Code.BIFURCATION, one.branch, kind=one.kind, side=one.side, value=one.value, error=one.error)
            for one in self.bifurcations
        ]
        for pair, (low, high) in enumerate(itertools.pairwise(self.values)):
            before, after = set(self.numbered[pair]), set(self.numbered[pair + 1])
            for branch in sorted(before ^ after):
                kinds = {one.kind for one in self.bifurcations if low <= one.value <= high and one.branch == branch}
                if not kinds - {GRAZING}:
                    change = "ends" if branch in before else "begins"
                    located = "only grazing" if kinds else "no bifurcation"
                    found.append(
                        Finding.of(Code.BRANCH_ENDS, branch, change=change, low=low, high=high, located=located)
                    )
        return (*found, *([Finding.of(Code.FOUND_BY_NEIGHBOUR, count=self.added)] if self.added else []))


def without_fraction(attractor: Attractor) -> Attractor:
    """Return an attractor whose basin fraction is unknown."""
    return dataclasses.replace(attractor, basin_fraction=np.nan, basin_fraction_error=np.nan)


def _doubled(one: int, other: int) -> bool:
    """Whether one period becomes the other by doubling or halving, any number of times."""
    ratio, rest = divmod(max(one, other), min(one, other))
    return rest == 0 and ratio & (ratio - 1) == 0


def _apart(first: Array, second: Array, size: Array) -> float:
    """Largest distance of a point of one set from the other set; the smaller of the two directions.

    So an orbit stays near the set from which it bifurcates when its period doubles or it becomes chaotic.
    """
    a, b = first[:, :2] / size, second[:, :2] / size
    return float(min(cKDTree(b).query(a)[0].max(), cKDTree(a).query(b)[0].max()))


def thinned(attractor: Attractor) -> Attractor:
    """Return an attractor with fewer samples along its orbit, which keeps its ends; a continuation has many."""
    every = math.ceil((len(attractor.orbit) - 1) / SAMPLES)
    if every < 2:
        return attractor
    kept = np.append(np.arange(0, len(attractor.orbit) - 1, every), len(attractor.orbit) - 1)
    return dataclasses.replace(attractor, orbit=attractor.orbit[kept])
