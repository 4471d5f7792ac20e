"""Turns what was traced along a parameter into the record of a continuation."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from vibrokit.errors import StructureError
from vibrokit.results.attractor import Attractor
from vibrokit.results.continuation import Bifurcation, Continuation, SteadyStates
from vibrokit.results.versions import versions
from vibrokit.scene_file import scene_data
from vibrokit.structure.orbits import refine_orbit, visited
from vibrokit.structure.tracing.bifurcations import GRAZING, Located
from vibrokit.structure.tracing.branches import Place, Tracing

_ORBIT_SAMPLES = 1024
_ONE = 1e-3  # share of the region's size within which the points of two bifurcations of one kind and value are one
_SHARP = 1e-7  # share of the span of the values within which their values are


def recorded(tracing: Tracing, searched: Sequence[tuple[float, str]], asked: int, *, complete: bool) -> Continuation:
    """Return the record of what was traced.

    Parameters
    ----------
    tracing : Tracing
    searched : sequence of (float, str)
        Every value that was looked at, and what the search said there.
    asked : int
        How many values were to be looked at.
    complete : bool
    """
    numbered = tracing.numbered()
    held = {value: index for index, value in enumerate(tracing.values)}
    states = []
    for value, said in searched:
        attractors = tracing.found[held[value]] if value in held else []
        branches = numbered[held[value]] if value in held else []
        states.append(SteadyStates(value, tuple(map(_thinned, attractors)), tuple(branches), said))
    bifurcations = _bifurcations(tracing, numbered)
    words = _status(tracing, numbered, states, bifurcations)
    if not complete:
        after = f"after {len(searched)} of {asked} values" if len(searched) < asked else "before its end"
        words.insert(0, f"The work was stopped {after}.")
    return Continuation(
        parameter=tracing.path,
        symbol="",
        unit=None,
        region=None,
        states=tuple(states),
        bifurcations=bifurcations,
        complete=complete,
        status=" ".join(words),
        scene=scene_data(tracing.osc),
        seed=None,
        seconds=0.0,
        versions=versions(),
    )


def _thinned(attractor: Attractor) -> Attractor:
    """The same with fewer samples along the orbit, for there will be many; its ends stay."""
    every = math.ceil((len(attractor.orbit) - 1) / _ORBIT_SAMPLES)
    if every < 2:
        return attractor
    kept = np.append(np.arange(0, len(attractor.orbit) - 1, every), len(attractor.orbit) - 1)
    return dataclasses.replace(attractor, orbit=attractor.orbit[kept])


def _bifurcations(tracing: Tracing, numbered: list[list[int]]) -> tuple[Bifurcation, ...]:
    """Each once, though it may have been met from both sides; the sharpest of them."""
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
    if abs(one.value - other.value) > _SHARP * span + one.error + other.error:
        return False
    points = other.point[None]
    if other.period > 1:  # they may have been met at different points of the orbit
        osc = tracing.osc.replace({tracing.path: other.value})
        try:
            points = visited(osc, refine_orbit(osc, other.point, other.period, tracing.stepper), tracing.stepper)
        except StructureError:
            return True
    away = np.abs(points[:, :2] - one.point[:2]) / tracing.size
    return bool(away.max(axis=1).min() < _ONE) or one.bracketed or other.bracketed


def _status(
    tracing: Tracing,
    numbered: list[list[int]],
    states: Sequence[SteadyStates],
    bifurcations: Sequence[Bifurcation],
) -> list[str]:
    count = len({branch for branches in numbered for branch in branches})
    words = [f"{_many(count, 'branch', 'branches')} along {_many(len(states), 'value', 'values')} of {tracing.path}."]
    if bifurcations:
        words.append(f"Located: {'; '.join(map(str, bifurcations))}.")
    words += _ends(tracing, numbered, bifurcations)
    if tracing.added:
        many = _many(tracing.added, "attractor was", "attractors were")
        words.append(f"{many} found from a neighbouring value, and not by the search.")
    words += [f"At {at.value:g} nothing was found: {at.status}" for at in states if not at.attractors]
    return words


def _ends(tracing: Tracing, numbered: list[list[int]], bifurcations: Sequence[Bifurcation]) -> list[str]:
    """Say where a branch begins or ends between two values for no bifurcation of its own that was located."""
    words = []
    for pair, (low, high) in enumerate(zip(tracing.values, tracing.values[1:], strict=False)):
        before, after = set(numbered[pair]), set(numbered[pair + 1])
        here = [one for one in bifurcations if low <= one.value <= high]
        for branch in sorted(before ^ after):
            kinds = {one.kind for one in here if one.branch == branch}
            if kinds - {GRAZING}:
                continue
            verb = "ends" if branch in before else "begins"
            but = " but grazing" if kinds else ""
            words.append(
                f"Branch {branch} {verb} between {low:g} and {high:g}; nothing of its own{but} was located there."
            )
    return words


def _many(count: int, one: str, more: str) -> str:
    return f"{count} {one if count == 1 else more}"
