"""PathSolver: from a cut candidate to the extremal path between two orbits, or from an orbit to a face.

A path is complete when it starts and ends so near to its orbits that its action no longer changes.
"""

from __future__ import annotations

import dataclasses
import enum
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.paths.action_descent import descend_action
from vibrokit.analyzers.paths.candidate import same_action
from vibrokit.analyzers.paths.gauss_newton import gauss_newton
from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.polishing.ending import Cut
from vibrokit.analyzers.polishing.extremal_path import ExtremalPath
from vibrokit.analyzers.polishing.linearized_orbit import LinearizedOrbit
from vibrokit.analyzers.polishing.newton import NotConverged, extremal_path
from vibrokit.analyzers.polishing.tolerances import TOLERANCES
from vibrokit.errors import StructureError

MORE_PERIODS = 2
"""Periods of its orbits by which a certified path must allow to be extended."""
_FROM_NEAR = TOLERANCES.evaluations // 3  # for a candidate with momenta, or a longer path
_FITTED = 5e-3  # of the action: accuracy of the Gauss–Newton method, by which a path is of a known family

Array = NDArray[np.float64]


class Effort(enum.IntEnum):
    """Rungs of a ladder: a candidate that leads to no path with one effort is tried with the next one later."""

    SHOOT = 0  # multiple shooting from the candidate's momenta
    DESCEND = 1  # Gauss–Newton method, descent of the action, and multiple shooting
    FROM_ORBIT = 2  # the same, in finer pieces too, and then for a path that starts on the orbit itself


@dataclasses.dataclass(frozen=True, eq=False)
class _Guess:
    """A candidate that leaves the source at one of its phases."""

    source: LinearizedOrbit
    first: int  # phase of the first node
    points: Array  # (nodes, 2n)
    cut: Cut
    action: float = math.nan  # of the Gauss–Newton method


class PathSolver:
    """Solves for paths that leave one orbit; each path that several candidates lead to is completed once."""

    def __init__(self, propagator: SegmentPropagator, source: LinearizedOrbit) -> None:
        self.propagator, self.source = propagator, source
        self._known: list[tuple[ExtremalPath, ExtremalPath | StructureError]] = []

    def solve(self, cuts: Sequence[Cut], effort: Effort = Effort.FROM_ORBIT, least: float = math.inf) -> ExtremalPath:
        """Return the extremal path near a candidate; raises StructureError if there is none.

        Multiple shooting from the candidate's momenta stays at the candidate, while descent may end at a cheaper path.
        Of several ways to cut the candidate, the cheapest after the Gauss–Newton method descends. A path that cannot be
        joined to its source by the linearized equations starts on the orbit itself, if it costs less than `least`,
        the least action known.
        """
        if effort is Effort.SHOOT:
            return self._once(self._shot(self._as_given(cuts[0]), _FROM_NEAR))
        fitted = (self._fitted(*_begun(self.propagator, self.source, cut), cut) for cut in cuts)
        guess = min(fitted, key=lambda each: each.action)
        action = guess.action
        for _, known in self._known:
            if isinstance(known, ExtremalPath) and _in_family(known, guess.first, guess.points, action):
                return known
        try:
            found = self._descended(guess)
            action = found.action
            return self._once(found)
        except StructureError as failure:
            hopeless = isinstance(failure, NotConverged) and failure.misfit > TOLERANCES.hopeful
            if effort < Effort.FROM_ORBIT or hopeless or not action < 0.999 * least:  # else not worth its cost
                raise
            return self._from_orbit(guess, failure)

    def _as_given(self, cut: Cut) -> _Guess:
        """A candidate with momenta, which begins and ends where it does itself."""
        assert cut.momenta is not None
        source, first = self.source.starting(self.source.closest(cut.states[:1])[2])
        return _Guess(source, first, np.hstack([cut.states, cut.momenta]), cut)

    def _fitted(self, source: LinearizedOrbit, first: int, states: Array, cut: Cut) -> _Guess:
        """A candidate after the Gauss–Newton method."""
        points, action = gauss_newton(self.propagator, first, states, cut.last, cut.ending.free)
        return _Guess(source, first, points, cut, action)

    def _descended(self, guess: _Guess, evaluations: int = TOLERANCES.evaluations) -> ExtremalPath:
        cut = guess.cut
        points, _ = descend_action(
            self.propagator, guess.first, guess.points,
            last=cut.last, free=cut.ending.free, closing=cut.ending.closing,
        )  # fmt: skip
        return self._shot(dataclasses.replace(guess, points=points), evaluations)

    def _shot(self, guess: _Guess, evaluations: int) -> ExtremalPath:
        return extremal_path(
            self.propagator, guess.source, guess.first, guess.cut.ending, guess.points, guess.cut.last,
            evaluations=evaluations, accepted=TOLERANCES.rough, nearly=TOLERANCES.radius,
        )  # fmt: skip

    def _once(self, found: ExtremalPath) -> ExtremalPath:
        """Complete a path, unless that was done or has failed before."""
        result = next((known for before, known in self._known if _are_one(before, found)), None)
        if result is None:
            try:
                result = completed(self.propagator, found)
            except StructureError as error:
                result = error
            self._known.append((found, result))
        if isinstance(result, StructureError):
            raise result
        return result

    def _from_orbit(self, guess: _Guess, failure: StructureError) -> ExtremalPath:
        """The longest path from the orbit itself that converges, or that hardly costs more than a longer one.

        It spends more and more section intervals near the orbit; after three failures in turn no longer one is tried,
        and the failure given is raised.
        """
        best, failures, propagator, cut = None, 0, self.propagator, guess.cut
        source = self.source.with_start_on_orbit()
        if source is None:
            raise failure
        for intervals in (8, 16, 32, 64, 128):
            added = intervals * propagator.pieces
            first = guess.first - added
            states = np.concatenate([source.along(first, added), guess.points[:, : propagator.size]])
            try:
                longer = self._fitted(source, first, states, cut)
                found = self._descended(longer, TOLERANCES.evaluations if best is None else _FROM_NEAR)
                found = within(propagator, found, TOLERANCES.radius * found.extent)
                solved_again(propagator, found, MORE_PERIODS * source.period_nodes, 0)
            except StructureError:
                failures += 1
                if best is not None or failures == 3:
                    break
                continue
            if best is not None and abs(found.action - best.action) <= TOLERANCES.lasting * best.action:
                break
            best = found
        if best is None:
            raise failure
        return best


def _are_one(one: ExtremalPath, other: ExtremalPath) -> bool:
    """Return whether two paths that were not completed are one, or of one family."""
    if one.flat and other.flat:
        return same_action(one.action, other.action) and _in_family(one, other.first, other.points, other.action)
    alike = one.source.node(one.first) == other.source.node(other.first) and len(one.points) == len(other.points)
    return alike and same_action(one.action, other.action)


def _in_family(known: ExtremalPath, first: int, points: Array, action: float) -> bool:
    """Return whether a path, exact or of the Gauss–Newton method, is of the family of a known one.

    All members have one action, and their states on the section lie on one line. Other paths, to other places, may have
    nearly the same action. Near is within 5 % of the extent; at most 512 states are compared.
    """
    if not known.flat or not same_action(known.action, action, _FITTED):
        return False
    grain, size = known.ending.propagator.grain, len(known.scale) // 2
    line, own = (
        nodes[-number % grain :: grain, :size] / known.scale[:size]
        for nodes, number in ((known.points, known.first), (points, first))
    )
    if not len(own) or len(line) < 2:
        return False
    starts, ways = line[:-1], np.diff(line, axis=0)
    lengths = np.maximum((ways**2).sum(axis=1), 1e-300)
    for state in own[np.linspace(0, len(own) - 1, min(len(own), 512)).astype(np.int64)]:
        along = np.clip(((state - starts) * ways).sum(axis=1) / lengths, 0, 1)
        if np.linalg.norm(state - starts - along[:, None] * ways, axis=1).min() >= 0.05:
            return False
    return True


def _begun(propagator: SegmentPropagator, source: LinearizedOrbit, cut: Cut) -> tuple[LinearizedOrbit, int, Array]:
    """The source, the phase there, and the states of a candidate from where it last is near the source.

    Near is within 1e-3 of its extent; up to 1000 section intervals on the orbit come before one that is never so near.
    The start stays on the orbit until multiple shooting, since far from it the linearized equations would give much
    too small an action.
    """
    states = cut.states
    nodes = np.arange(0, len(states) - 1, propagator.grain)
    closest, places = source.nearest(states[nodes], nodes)
    wanted = 1e-3 * float(np.linalg.norm(np.ptp(states, axis=0) / propagator.units))
    near = np.flatnonzero(closest <= wanted)
    entered = int(near[-1]) if near.size else 0
    (source, first), states = source.starting(places[entered]), states[nodes[entered] :]
    if not near.size:
        periods = math.ceil(math.log(closest[0] / wanted) / (source.slowest_rate * propagator.pieces))
        added = min(periods, 1000) * propagator.pieces
        first -= added
        states = np.concatenate([source.along(first, added), states])
    return source, first, np.concatenate([source.along(first, 1), states[1:]])


def completed(propagator: SegmentPropagator, found: ExtremalPath) -> ExtremalPath:
    """Return the same path, started and ended so near to its orbits that the action no longer changes.

    Raises StructureError if it cannot be joined to them by the linearized equations.
    """
    radius = TOLERANCES.radius * found.extent
    try:
        found = within(propagator, found, radius)
    except StructureError:
        if not found.flat:  # of one of a family, only the error of the linearized equations may be too large
            raise
        radius /= 10
        found = within(propagator, found, radius)
    for _ in range(4):
        radius /= 10
        closer = within(propagator, found, radius)
        if abs(closer.action - found.action) <= TOLERANCES.unchanged * abs(found.action):
            break
        found = closer
    return found


def within(propagator: SegmentPropagator, found: ExtremalPath, radius: float) -> ExtremalPath:
    """Return the same path, started and ended within a radius of its orbits, or raise StructureError.

    It is made longer in steps where all at once does not converge, which generic paths never need.
    """
    grain, source, share, failures = propagator.grain, found.source, 1, 0
    while True:
        before = 0 if source.start_on_orbit else source.missing(found.points, found.first, -1, radius, grain) // grain
        after = found.ending.missing(found.points, radius) // grain
        try:
            longer = solved_again(propagator, found, int(before / share) * grain, int(after / share) * grain)
        except StructureError:
            failures += 1
            if failures > 6 or max(abs(before), abs(after)) < 2 * share:
                raise
            share *= 2
            continue
        if share == 1:
            return longer
        found, share = longer, share // 2


def solved_again(
    propagator: SegmentPropagator, found: ExtremalPath, before: int, after: int, accepted: float = TOLERANCES.accepted
) -> ExtremalPath:
    """Solve for the same path with so many nodes more (or fewer, if negative) before and after.

    Raises StructureError if it does not converge, or if hardly anything of the path would be left.
    """
    points, first = found.points, found.first
    if len(points) + min(before, 0) + min(after, 0) < 2:
        raise StructureError(
            f"a path of {len(points)} nodes cannot be made {-min(before, 0) - min(after, 0)} nodes shorter."
        )
    more = found.source.continued(points[0], first, -max(before, 0))
    points = np.concatenate([more, points[max(-before, 0) :]])
    points, ending = found.ending.extended(points, after)
    return extremal_path(
        propagator, found.source, first - before, ending, points, found.last,
        evaluations=TOLERANCES.evaluations // 8, accepted=accepted,
    )  # fmt: skip
