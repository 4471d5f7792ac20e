"""Where branches of steady states exist along a parameter, and which stops they touch there."""

import dataclasses
import itertools
from collections.abc import Collection, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from vibrokit.results.continuation import GRAZING, Continuation

_NOT_LOCATED = "not located"
_NEAR = 1e-7  # of the span of the values, within which two stops are grazed at once


@dataclasses.dataclass(frozen=True)
class Existence:
    """From where to where a branch of steady states exists without a gap and touches the same stops.

    `first` and `last` are values of the parameter: located where the branch ends in a bifurcation, otherwise between
    the last value at which it was found and the next; the last value itself at an end of the sweep, and where there is
    no state at the next. `begins` and `ends` are the kind of the bifurcation; ``"goes on"`` at an end of the sweep,
    ``"nothing beyond"`` where the next value has no state or is refused, ``"not located"`` otherwise. Where the branch
    goes on and touches other stops, they are ``"grazing"``, or ``"not located"`` halfway between two values. `touches`
    has the sides of the stops.
    """

    name: str
    first: float
    last: float
    begins: str
    ends: str
    touches: tuple[str, ...] = ()


def touches_text(one: Existence) -> str:
    """Return which stops are touched, as text."""
    return f"touches {' and '.join(one.touches)}" if one.touches else "clear of stops"


def coexistence(states: Continuation, refused: Collection[float]) -> Iterator[Existence]:
    """Yield where each branch exists, in the order of the branches, given the values without a steady state."""
    for number, name in enumerate(states.branch_names):
        found = np.isin(states.values, [value for value, _ in states.branch(number)])
        places = np.flatnonzero(found)
        for stretch in np.split(places, np.flatnonzero(np.diff(places) > 1) + 1):
            first, begins = _end(states, refused, number, int(stretch[0]), -1)
            last, ends = _end(states, refused, number, int(stretch[-1]), 1)
            for value, kind, touched in _parts(states, number, stretch, first, last):
                yield Existence(name, first, value, begins, kind or ends, touched)
                first, begins = value, kind


def _parts(
    states: Continuation, number: int, stretch: NDArray[np.intp], first: float, last: float
) -> Iterator[tuple[float, str, tuple[str, ...]]]:
    """Yield the parts of a stretch of a branch in which it touches the same stops: end, its kind, and stops.

    The last part has no kind.
    """
    attractors, near = dict(states.branch(number)), _NEAR * float(np.ptp(states.values))
    values = states.values[stretch].tolist()
    touched = set(attractors[values[0]].touched)
    changes: list[tuple[float, str, str]] = []
    for side in ("left", "right"):
        known = [(value, side in attractors[value].touched) for value in values]
        met = [one for one in _grazed(states, number, side) if first + near < one < last - near]
        found = list(_changes([(first, None), *known, (last, None)], met))
        changes += [(value, kind, side) for value, kind in found]
        if sum(value < values[0] for value, _ in found) % 2:
            touched ^= {side}
    changes.sort()
    while changes:
        together = [one for one in changes if one[0] <= changes[0][0] + near]  # a symmetric orbit grazes both stops
        changes = changes[len(together) :]
        kinds = {kind for _, kind, _ in together}
        yield together[0][0], _NOT_LOCATED if _NOT_LOCATED in kinds else GRAZING, tuple(sorted(touched))
        for _, _, side in together:
            touched ^= {side}
    yield last, "", tuple(sorted(touched))


def _changes(known: Sequence[tuple[float, bool | None]], grazed: Sequence[float]) -> Iterator[tuple[float, str]]:
    """Yield where a branch begins or ceases to touch a stop, and how it is known.

    It is known at some values whether the branch touches the stop, and where it grazes it; at other grazings one more
    turn of the orbit touches the stop, or leaves it.
    """
    for (low, before), (high, after) in itertools.pairwise(known):
        met = [value for value in grazed if low <= value <= high]
        if before is None or after is None:  # at an end of the branch
            if met and (before, after) in ((False, None), (None, False)):
                yield met[0] if after is None else met[-1], GRAZING
        elif before is not after:
            yield ((met[0] if after else met[-1]), GRAZING) if met else (0.5 * (low + high), _NOT_LOCATED)
        elif not before and len(met) > 1:  # it touches the stop only in between
            yield met[0], GRAZING
            yield met[-1], GRAZING


def _grazed(states: Continuation, number: int, side: str) -> list[float]:
    """Where a branch grazes a stop, ascending."""
    marks = states.bifurcations
    return sorted(one.value for one in marks if (one.kind, one.branch, one.side) == (GRAZING, number, side))


def _end(
    states: Continuation, refused: Collection[float], number: int, place: int, direction: int
) -> tuple[float, str]:
    """Where a branch ends beyond a value, and how."""
    here, beyond = float(states.values[place]), place + direction
    if not 0 <= beyond < len(states.values):
        return here, "goes on"
    there = float(states.values[beyond])
    low, high = sorted((here, there))
    met = [one for one in states.bifurcations if one.branch == number and low <= one.value <= high]
    if met:
        last = max(met, key=lambda one: direction * one.value)
        return last.value, last.kind
    if there in refused:
        return here, "nothing beyond"
    return 0.5 * (here + there), _NOT_LOCATED
