"""Names of attractors, from what they do."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from vibrokit.results.attractor import Attractor

_SIZES: Mapping[int, tuple[str, ...]] = {2: ("small", "large"), 3: ("small", "medium", "large")}
_PLACES: Mapping[int, tuple[str, ...]] = {2: ("left", "right"), 3: ("left", "middle", "right")}


def labelled(attractors: Sequence[Attractor], *, has_stops: bool) -> tuple[Attractor, ...]:
    """Return attractors with their places as labels, and with names, which depend on their order."""
    names = names_of(attractors, has_stops=has_stops)
    return tuple(
        dataclasses.replace(attractor, label=label, name=name)
        for label, (attractor, name) in enumerate(zip(attractors, names, strict=True))
    )


def order_of(attractor: Attractor) -> tuple[Any, ...]:
    """Return what attractors are sorted by before they are named: those clear of the stops first."""
    return not attractor.repeats, attractor.impacts, attractor.period, tuple(attractor.points[0])


def names_of(attractors: Sequence[Attractor], *, has_stops: bool) -> tuple[str, ...]:
    """Return a short, distinct name for each attractor.

    ``clear`` runs clear of the stops, ``hammering`` hits them, ``pressed`` stays in contact with one. In a scene
    without stops an orbit is an ``oscillation``. An equilibrium clear of the stops is ``rest``, a limit cycle
    ``cycle``; motion that turns over is ``running``, with its turns in a period if these are more than one; motion that
    never repeats is ``quasiperiodic`` or ``chaotic``. The period follows if it is not 1: ``hammering-period-4``. Two or
    three attractors of one name become ``small-``, ``medium-`` and ``large-`` by amplitude if these are 10 % apart, or
    ``left-``, ``middle-`` and ``right-`` by place if that differs by a tenth of their width. Where neither
    distinguishes them, or where there are more, all but the first are numbered.
    """
    return _distinct([_base(attractor, has_stops) for attractor in attractors], attractors)


def branch_names_of(branches: Sequence[Sequence[Attractor]], *, has_stops: bool) -> tuple[str, ...]:
    """Return a short, distinct name for each branch, that of its first attractor; each has one or more.

    A branch that touches a stop in one part and not in another, or hits it in one and stays in contact in another, has
    the names of all: ``clear-and-hammering``.
    """
    return _distinct([_base_of_branch(branch, has_stops) for branch in branches], [branch[0] for branch in branches])


def _distinct(bases: Sequence[str], attractors: Sequence[Attractor]) -> tuple[str, ...]:
    names = list(bases)
    for base in dict.fromkeys(bases):
        group = [index for index, name in enumerate(bases) if name == base]
        words = _distinguishing([attractors[index] for index in group])
        for number, index in enumerate(group[1:], start=2):
            names[index] = f"{base}-{number}"
        for index, word in zip(group, words, strict=False):
            names[index] = f"{word}-{base}"
    return tuple(names)


def _base(attractor: Attractor, has_stops: bool) -> str:
    return _motion(attractor, has_stops) + _repetition(attractor)


def _base_of_branch(branch: Sequence[Attractor], has_stops: bool) -> str:
    first = _motion(branch[0], has_stops)
    if first not in ("clear", "rest", "pressed", "hammering"):  # says nothing of stops
        return first + _repetition(branch[0])
    firsts: dict[tuple[bool, bool], Attractor] = {}
    for attractor in branch:
        firsts.setdefault((bool(attractor.touched), attractor.impacts > 0), attractor)
    words = dict.fromkeys(_motion(one, has_stops) for one in firsts.values())
    return "-and-".join(words) + _repetition(branch[0])


def _motion(attractor: Attractor, has_stops: bool) -> str:
    """The name of a motion, without its period."""
    if attractor.kind in ("quasiperiodic", "chaotic"):
        return attractor.kind
    if attractor.turns:
        often = abs(attractor.turns) / attractor.period
        return "running" if often <= 1 else f"running-{often:.3g}-turns"
    if attractor.kind == "limit cycle":
        return "cycle"
    if attractor.touched and not attractor.impacts:
        return "pressed"
    if attractor.kind == "equilibrium":
        return "rest"
    return "oscillation" if not has_stops else "hammering" if attractor.impacts else "clear"


def _repetition(attractor: Attractor) -> str:
    """Its period, if that is not 1."""
    return f"-period-{attractor.period}" if attractor.repeats and attractor.period != 1 else ""


def _distinguishing(group: Sequence[Attractor]) -> tuple[str, ...]:
    """Words that distinguish attractors of one name; empty if there are none."""
    widths = [0.0 if one.turns else float(np.ptp(one.orbit[:, 0])) for one in group]
    if len(group) in _SIZES and all(large > 1.1 * small > 0 for small, large in itertools.pairwise(sorted(widths))):
        return _in_order(_SIZES[len(group)], widths)
    if all(one.turns for one in group):
        middles = [float(np.sign(one.turns)) for one in group]
        return _in_order(_PLACES[2], middles) if sorted(middles) == [-1.0, 1.0] else ()
    middles = [float(one.orbit[:, 0].mean()) for one in group]
    least = 0.1 * max(*widths, 1e-9 * max(map(abs, middles)), 0.0)
    if len(group) in _PLACES and all(right - left > least for left, right in itertools.pairwise(sorted(middles))):
        return _in_order(_PLACES[len(group)], middles)
    return ()


def _in_order(words: Sequence[str], values: Sequence[float]) -> tuple[str, ...]:
    """Return the word of each value, the first word for the smallest."""
    ranks = np.argsort(np.argsort(values))
    return tuple(words[rank] for rank in ranks)
