"""What a tracing found along a parameter: bifurcations, names of branches, findings."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Sequence

import numpy as np

from vibrokit.errors import StructureError
from vibrokit.results.attractor import Attractor
from vibrokit.results.bifurcation import Bifurcation
from vibrokit.results.finding import Code, Finding
from vibrokit.structure.attractors.names import names_of
from vibrokit.structure.orbits import refine_orbit, visited
from vibrokit.structure.tracing.bifurcations import GRAZING, Located
from vibrokit.structure.tracing.branches import Place, Tracing

_ORBIT_SAMPLES = 1024
_SAME_POINT = 1e-3  # share of the region's size within which the points of two bifurcations are the same
_SAME_VALUE = 1e-7  # share of the span of the values within which their values are

Numbered = list[list[int]]
"""The branch of every attractor, value by value."""


def thinned(attractor: Attractor) -> Attractor:
    """Return an attractor with fewer samples along its orbit, which keeps its ends; a continuation has many."""
    every = math.ceil((len(attractor.orbit) - 1) / _ORBIT_SAMPLES)
    if every < 2:
        return attractor
    kept = np.append(np.arange(0, len(attractor.orbit) - 1, every), len(attractor.orbit) - 1)
    return dataclasses.replace(attractor, orbit=attractor.orbit[kept])


def branch_names(tracing: Tracing, numbered: Numbered) -> tuple[str, ...]:
    """Return the names of the branches, from the first attractor of each."""
    first: dict[int, Attractor] = {}
    for attractors, branches in zip(tracing.found, numbered, strict=True):
        for attractor, branch in zip(attractors, branches, strict=True):
            first.setdefault(branch, attractor)
    return names_of([first[branch] for branch in sorted(first)], has_stops=bool(tracing.osc.barriers))


def bifurcations_of(tracing: Tracing, numbered: Numbered) -> tuple[Bifurcation, ...]:
    """Return each bifurcation once, the most accurate if it was located from both sides."""
    kept: list[tuple[Place, Located]] = []
    for place, found in sorted(tracing.located, key=lambda one: one[1].error):
        if not any(_same(tracing, found, known) for _, known in kept):
            kept.append((place, found))
    kept.sort(key=lambda one: (one[1].value, one[1].kind))
    return tuple(
        Bifurcation(found.kind, found.value, found.error, numbered[at][index], found.period, found.point, found.side)
        for (at, index), found in kept
    )


def _same(tracing: Tracing, one: Located, other: Located) -> bool:
    if (one.kind, one.period, one.side) != (other.kind, other.period, other.side):
        return False
    span = abs(tracing.values[-1] - tracing.values[0])
    if abs(one.value - other.value) > _SAME_VALUE * span + one.error + other.error:
        return False
    points = other.point[None]
    if other.period > 1:  # they may have different points of the orbit
        osc = tracing.osc.replace({tracing.path: other.value})
        try:
            points = visited(osc, refine_orbit(osc, other.point, other.period, tracing.stepper), tracing.stepper)
        except StructureError:
            return True
    away = np.abs(points[:, :2] - one.point[:2]) / tracing.size
    return bool(away.max(axis=1).min() < _SAME_POINT) or one.bracketed or other.bracketed


def branch_findings(
    tracing: Tracing, numbered: Numbered, bifurcations: Sequence[Bifurcation], values: int
) -> tuple[Finding, ...]:
    """Return findings about the branches at some number of values."""
    count = len({branch for branches in numbered for branch in branches})
    found = [Finding.of(Code.BRANCHES, branches=count, values=values, parameter=tracing.path)]
    found += [
        Finding.of(Code.BIFURCATION, one.branch, kind=one.kind, side=one.side, value=one.value, error=one.error)
        for one in bifurcations
    ]
    found += _ends(tracing, numbered, bifurcations)
    if tracing.added:
        found.append(Finding.of(Code.FOUND_BY_NEIGHBOUR, count=tracing.added))
    return tuple(found)


def _ends(tracing: Tracing, numbered: Numbered, bifurcations: Sequence[Bifurcation]) -> Iterator[Finding]:
    """Findings about branches that begin or end between two values without a located bifurcation."""
    for pair, (low, high) in enumerate(zip(tracing.values, tracing.values[1:], strict=False)):
        before, after = set(numbered[pair]), set(numbered[pair + 1])
        for branch in sorted(before ^ after):
            kinds = {one.kind for one in bifurcations if low <= one.value <= high and one.branch == branch}
            if not kinds - {GRAZING}:
                change = "ends" if branch in before else "begins"
                located = "only grazing" if kinds else "no bifurcation"
                yield Finding.of(Code.BRANCH_ENDS, branch, change=change, low=low, high=high, located=located)
