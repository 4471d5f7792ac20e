"""Heteroclinic: from a cut candidate to the extremal path, begun and ended as near to its two ends as wanted."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.polishing.carrier import Carrier
from vibrokit.analyzers.polishing.chain import smooth_chain
from vibrokit.analyzers.polishing.destinations import Cut
from vibrokit.analyzers.polishing.endings import ComesTo
from vibrokit.analyzers.polishing.ends import End
from vibrokit.analyzers.polishing.newton import Extremum, extremal_path
from vibrokit.analyzers.polishing.relaxing import relaxed
from vibrokit.errors import StructureError

_NEAR = 1e-3  # of a path's extent: how near its source a candidate is entered
_RADIUS = 1e-4  # of a path's extent: how near its two ends the linearised equations take over
_CLOSER, _UNCHANGED = 4, 1e-8  # tenths of that, until the action stays, relative to itself
_ENOUGH = 1e-6  # the same for a path begun on its orbit, made twice as long
_LOOKS = 24  # of Newton's method for a path that is known but for its ends
_HELD = (8, 16, 32, 64, 128)  # section intervals on the orbit, where a path is begun on it
_FAILURES = 3  # of those in turn, after which no longer one is tried
MORE = 2
"""Periods of its orbits by which a certified path may be made longer."""
_FEWEST = 2  # nodes of a path
_MOST_ADDED = 1000  # section intervals before a candidate that starts far from its source

Array = NDArray[np.float64]


class Polisher:
    """Polishes candidates that leave one orbit: each path that some of them lead to is followed to its ends once."""

    def __init__(self, carrier: Carrier, source: End) -> None:
        self.carrier, self.source = carrier, source
        self._known: dict[tuple[int, int, str], Extremum | StructureError] = {}

    def polished(self, cuts: Sequence[Cut], worth: float = np.inf) -> Extremum:
        """Polish a candidate: smoothed as a chain, relaxed to a minimum of the action, solved for by Newton's method.

        Parameters
        ----------
        cuts : sequence of Cut
            The candidate ended in several ways, of which the cheapest is taken once they are smoothed.
        worth : float
            Action below which a path that cannot be joined to its source by linear motion is begun on that.

        Raises
        ------
        StructureError
            No extremal path was found near it.
        """
        carrier, source = self.carrier, self.source
        tried = []
        for cut in cuts:
            first, states = _begun(carrier, source, cut.states)
            tried.append((smooth_chain(carrier, first, states, cut.last), first, cut))
        chain, first, cut = min(tried, key=lambda each: each[0].action)
        try:
            points = relaxed(carrier, first, cut.ending, chain.points, cut.last)
            begun = extremal_path(carrier, source, first, cut.ending, points, last=cut.last)
        except StructureError as error:
            if not chain.action < worth:
                raise
            return _left_in_time(carrier, source, first, cut, chain.points, error)
        key = source.node(first), len(begun.points), f"{begun.action:.9e}"
        if key not in self._known:
            try:
                self._known[key] = self._followed(begun, first, cut, chain.points, worth)
            except StructureError as error:
                self._known[key] = error
        found = self._known[key]
        if isinstance(found, StructureError):
            raise found
        return found

    def _followed(self, begun: Extremum, first: int, cut: Cut, points: Array, worth: float) -> Extremum:
        try:
            return _left_for_good(self.carrier, begun)
        except StructureError as error:
            if not begun.action < worth:
                raise
            return _left_in_time(self.carrier, self.source, first, cut, points, error)


def _left_for_good(carrier: Carrier, found: Extremum) -> Extremum:
    """The path that leaves in the unstable space, begun and ended so near to its two ends that it does not matter."""
    radius = _RADIUS * extent(found)
    found = _within(carrier, found, radius)
    for _ in range(_CLOSER):
        radius /= 10
        closer = _within(carrier, found, radius)
        if abs(closer.action - found.action) <= _UNCHANGED * abs(found.action):
            break
        found = closer
    return found


def _left_in_time(
    carrier: Carrier, orbit: End, first: int, cut: Cut, points: Array, failure: StructureError
) -> Extremum:
    """The path that starts on the orbit itself, so long that it costs no more than a longer one; else the failure."""
    best, failures = None, 0
    source, size = orbit.on_orbit(), len(orbit.states[0])
    for intervals in _HELD:
        added = intervals * carrier.pieces
        held = source.states[(first - added + np.arange(added)) % len(source.states)]
        states = np.concatenate([held, points[:, :size]])
        try:
            chain = smooth_chain(carrier, first - added, states, cut.last)
            guess = relaxed(carrier, first - added, cut.ending, chain.points, cut.last)
            found = extremal_path(carrier, source, first - added, cut.ending, guess, last=cut.last)
            found = _within(carrier, found, _RADIUS * extent(found))
            solved_again(carrier, found, MORE * len(source.states), 0)
        except StructureError:
            failures += 1
            if best is not None or failures == _FAILURES:
                break
            continue
        if best is not None and abs(found.action - best.action) <= _ENOUGH * best.action:
            break
        best = found
    if best is None:
        raise failure
    return best


def _within(carrier: Carrier, found: Extremum, radius: float) -> Extremum:
    """The same path, begun and ended within a radius of its two ends; in parts where all at once is too much."""
    grain, least = _grain(carrier), 0
    while True:
        before, after = _missing_before(carrier, found, radius), _missing_after(carrier, found, radius)
        try:
            return solved_again(carrier, found, before, after)
        except StructureError:
            if max(before, after) <= least:
                raise
        least = grain
        found = _a_part(carrier, found, before // grain, after // grain)


def _a_part(carrier: Carrier, found: Extremum, before: int, after: int) -> Extremum:
    """The same path, longer by as much as Newton's method follows of so many section intervals before and after."""
    grain = _grain(carrier)
    while True:
        before, after = int(before / 2), int(after / 2)
        try:
            return solved_again(carrier, found, before * grain, after * grain)
        except StructureError:
            if max(before, after) <= 1:
                raise


def solved_again(carrier: Carrier, found: Extremum, before: int, after: int) -> Extremum:
    """Solve for the same path, made longer (or shorter, if negative) by so many nodes before and after."""
    points, first, ending = found.points, found.first, found.ending
    if len(points) + min(before, 0) + min(after, 0) < _FEWEST:
        raise StructureError(f"a path of {len(points)} nodes cannot be made {-min(before, 0) - min(after, 0)} shorter.")
    if before > 0:
        points = np.concatenate([found.source.before(points[0], first, before), points])
    elif before < 0:
        points = points[-before:]
    if isinstance(ending, ComesTo):
        if after > 0:
            points = np.concatenate([points, ending.end.after(points[-1], ending.phase, after)])
        elif after < 0:
            points = points[:after]
        ending = ComesTo(ending.end, ending.phase + after)
    last = ending.last(found.free, carrier.piece)
    return extremal_path(carrier, found.source, first - before, ending, points, last=last, looks=_LOOKS)


def extent(found: Extremum) -> float:
    """How far from its source a path comes, in (x, v)."""
    return float(start_distances(found).max())


def start_distances(found: Extremum) -> Array:
    """Distances in (x, v) from the source, node by node."""
    nodes = (found.first + np.arange(len(found.points))) % len(found.source.states)
    return np.linalg.norm(found.points[:, :2] - found.source.states[nodes, :2], axis=1)


def end_distances(found: Extremum) -> Array:
    """Distances in (x, v) from the saddle, node by node, from the end backwards; 0 for a touch."""
    ending = found.ending
    if not isinstance(ending, ComesTo):
        return np.zeros(1)
    nodes = (ending.phase - np.arange(len(found.points))) % len(ending.end.states)
    return np.linalg.norm(found.points[::-1, :2] - ending.end.states[nodes, :2], axis=1)


def _begun(carrier: Carrier, source: End, states: Array) -> tuple[int, Array]:
    """Begin a candidate on its source, at the section where it last is near, or long enough before its first state.

    It stays on the orbit there until the path is polished: the linearised equations would price a start far off, where
    they do not hold, for next to nothing.
    """
    size = np.ones(states.shape[1])
    size[1] = carrier.osc.natural_frequency
    nodes = np.arange(0, len(states) - 1, _grain(carrier))
    phases = np.arange(0, len(source.states), carrier.pieces)
    apart = np.linalg.norm((states[nodes][:, None] - source.states[phases]) / size, axis=2)
    nearest, closest = phases[np.argmin(apart, axis=1)], apart.min(axis=1)
    wanted = _NEAR * float(np.linalg.norm(np.ptp(states, axis=0) / size))
    near = np.flatnonzero(closest <= wanted)
    entered = int(nodes[near[-1]]) if near.size else 0
    first, states = int(nearest[entered // _grain(carrier)]), states[entered:]
    if not near.size:
        periods = math.ceil(math.log(closest[0] / wanted) / (source.rate() * carrier.pieces))
        added = min(periods, _MOST_ADDED) * carrier.pieces
        first -= added
        states = np.concatenate([source.states[(first + np.arange(added)) % len(source.states)], states])
    return first, np.concatenate([source.point(first)[None, : states.shape[1]], states[1:]])


def _missing_before(carrier: Carrier, found: Extremum, radius: float) -> int:
    """Nodes to add before a path for it to start nearer to the source than a radius; negative: to drop."""
    if found.source.held:
        return 0
    each = _grain(carrier)
    distances = start_distances(found)[::each]
    if distances[0] <= radius:
        return -each * (int(np.argmax(distances > radius)) - 1)  # from the last before it first is farther away
    added, point = 0, found.points[0]
    while np.linalg.norm((point - found.source.point(found.first - added))[:2]) > radius:
        point = found.source.before(point, found.first - added, each)[0]
        added += each
    return added


def _missing_after(carrier: Carrier, found: Extremum, radius: float) -> int:
    """The same at the other end."""
    ending, each = found.ending, _grain(carrier)
    if not isinstance(ending, ComesTo):
        return 0
    distances = end_distances(found)[::each]
    if distances[0] <= radius:
        return -each * (int(np.argmax(distances > radius)) - 1)
    added, point = 0, found.points[-1]
    while np.linalg.norm((point - ending.end.point(ending.phase + added))[:2]) > radius:
        point = ending.end.after(point, ending.phase + added, each)[-1]
        added += each
    return added


def _grain(carrier: Carrier) -> int:
    """Nodes from section to section; without forcing each is on it."""
    return 1 if carrier.osc.autonomous else carrier.pieces
