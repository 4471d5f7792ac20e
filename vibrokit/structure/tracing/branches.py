"""Joins the steady states at neighbouring values of a parameter into branches."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree

from vibrokit.errors import VibrokitError
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.progress import advance, stage
from vibrokit.results.attractor import Attractor
from vibrokit.structure.attractors.describe import describe_cycle, describe_orbit
from vibrokit.structure.cycles import Cycle
from vibrokit.structure.linear_map import linear_map
from vibrokit.structure.orbits import Orbit, refine_orbit, visited
from vibrokit.structure.tracing.bifurcations import DOUBLING, Located
from vibrokit.structure.tracing.families import Family, Member
from vibrokit.structure.tracing.following import family_of, follow

_SAME = 1e-5  # share of the region's size within which two points are one
_NEAR = 0.1  # the same, within which two sets of points may belong to one branch
_CERTAIN = -1.0  # cost of a pair that one family joins

Array = NDArray[np.float64]
Place = tuple[int, int]
"""A value, by its index, and an attractor there, by its index."""


class Tracing:
    """Steady states at each value, the links between neighbouring values, and the bifurcations between.

    Parameters
    ----------
    osc : Oscillator
    path : str
        Of the parameter.
    values : list of float
        Those with steady states, ascending.
    found : list of list of Attractor
        Attractors at each. Those that the search missed are added, with basin fraction NaN.
    size : array (2,)
        Width of the region in x and in v.
    stepper : Stepper
    """

    def __init__(
        self,
        osc: Oscillator,
        path: str,
        values: list[float],
        found: list[list[Attractor]],
        size: Array,
        stepper: Stepper,
    ) -> None:
        self.osc, self.path, self.values, self.found = osc, path, values, found
        self.size, self.stepper = size, stepper
        self.links: list[dict[int, int]] = [{} for _ in values[1:]]
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

    def numbered(self) -> list[list[int]]:
        """Return the branch of every attractor, numbered as they appear."""
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
        if not attractor.repeats:
            return
        try:
            family = family_of(self.osc, self.path, attractor, start, target, self.size, self.stepper)
            followed = follow(family, attractor, start, target)
        except VibrokitError:  # it stays unlinked, and a finding says that its branch ends
            return
        self.located += [((at, index), bifurcation) for bifurcation in followed.bifurcations]
        if followed.end is None:
            return
        other = self._known(family, followed.end, to)
        if other is None and followed.stable:
            other = self._add(family, followed.end, to)
        if other is None:
            self._led_to[at, index, to] = self._points(family, followed.end)
            return
        first, second, pair = (index, other, at) if to > at else (other, index, to)
        if first not in self.links[pair] and second not in self.links[pair].values():
            self.links[pair][first] = second

    def _known(self, family: Family, member: Member, at: int) -> int | None:
        for index, attractor in enumerate(self.found[at]):
            if (attractor.kind, attractor.period) == (family.kind, family.period):
                away = np.abs(attractor.points[:, :2] - member.point[:2]) / self.size
                if away.max(axis=1).min() < _SAME:
                    return index
        return None

    def _add(self, family: Family, member: Member, at: int) -> int | None:
        osc = family.at(self.values[at])
        try:
            if family.kind == "limit cycle":
                cycle = Cycle(member.point, member.duration, member.derivative, member.residual)
                attractor = describe_cycle(osc, cycle, self.stepper)
            else:
                found = linear_map(osc, member.point[None], self.stepper, intervals=family.period)
                orbit = Orbit(member.point, family.period, found.derivatives[0], member.residual)
                attractor = describe_orbit(osc, orbit, self.stepper)
        except VibrokitError:
            return None
        self.found[at].append(without_fraction(attractor))
        self.added += 1
        return len(self.found[at]) - 1

    def _points(self, family: Family, member: Member) -> Array:
        if family.kind != "periodic":
            return member.point[None]
        orbit = Orbit(member.point, family.period, member.derivative, member.residual)
        return visited(family.at(member.value), orbit, self.stepper)

    def _pair_off(self, pair: int) -> None:
        """Join by the smallest sum of distances between the sets of points, except for those that are too far apart."""
        first, second = self.found[pair], self.found[pair + 1]
        costs = np.full((len(first), len(second)), 2 * _NEAR)
        for row, before in enumerate(first):
            for column, after in enumerate(second):
                here = self._led_to.get((pair, row, pair + 1), before.points)
                there = self._led_to.get((pair + 1, column, pair), after.points)
                away = min(_apart(here, after.points, self.size), _apart(before.points, there, self.size))
                costs[row, column] = min(away, 2 * _NEAR)
        for row, column in self.links[pair].items():
            costs[row, column] = _CERTAIN
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
                orbit = refine_orbit(self.osc.replace({self.path: start}), guess, period, self.stepper)
                parent = dataclasses.replace(large, points=orbit.point[None], period=period)
                family = family_of(self.osc, self.path, parent, start, target, self.size, self.stepper)
                passed = follow(family, parent, start, target).bifurcations
            except VibrokitError:
                return
            self.located += [(many, found) for found in passed if found.kind == DOUBLING]
            period //= 2


def without_fraction(attractor: Attractor) -> Attractor:
    """Return an attractor whose basin fraction is unknown."""
    return dataclasses.replace(attractor, basin_fraction=np.nan, basin_fraction_error=np.nan)


def _apart(first: Array, second: Array, size: Array) -> float:
    """Largest distance of a point of one set from the other set; the smaller of the two directions.

    So an orbit stays near the set from which it bifurcates when its period doubles or it becomes chaotic.
    """
    a, b = first[:, :2] / size, second[:, :2] / size
    return float(min(cKDTree(b).query(a)[0].max(), cKDTree(a).query(b)[0].max()))
