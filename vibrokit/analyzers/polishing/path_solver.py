"""PathSolver: from a cut candidate to the extremal path between two orbits, or from an orbit to a face."""

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
from vibrokit.analyzers.polishing.completion import MORE_PERIODS, completed, solved_again, within
from vibrokit.analyzers.polishing.ending import Cut
from vibrokit.analyzers.polishing.extremal_path import ExtremalPath
from vibrokit.analyzers.polishing.linearized_orbit import LinearizedOrbit
from vibrokit.analyzers.polishing.newton import NotConverged, extremal_path
from vibrokit.analyzers.polishing.tolerances import TOLERANCES
from vibrokit.errors import StructureError

_NEAR = 1e-3  # of a path's extent: a candidate is cut where it last is this near to its source
_ON_ORBIT = (8, 16, 32, 64, 128)  # section intervals spent near the orbit by a path that starts on it
_FAILURES = 3  # of these in turn, after which no longer one is tried
_FROM_NEAR = TOLERANCES.evaluations // 3  # for a candidate with momenta, or a longer path
_FITTED = 5e-3  # of the action: accuracy of the Gauss–Newton method, by which a path is of a known family
_MOST_ADDED = 1000  # section intervals before a candidate that starts far from its source

Array = NDArray[np.float64]


class Effort(enum.IntEnum):
    """Rungs of a ladder: a candidate that leads to no path with one effort is tried with the next one later."""

    JOIN = 0  # multiple shooting for a candidate that is a path but for its ends, which needs 3 to 6 evaluations
    SHOOT = 1  # multiple shooting from the candidate's momenta
    DESCEND = 2  # Gauss–Newton method, descent of the action, and multiple shooting
    FROM_ORBIT = 3  # the same, in finer pieces too, and then for a path that starts on the orbit itself


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
        if effort <= Effort.SHOOT:
            evaluations = TOLERANCES.evaluations // 16 if effort is Effort.JOIN else _FROM_NEAR
            return self._once(self._shot(self._as_given(cuts[0]), evaluations))
        fitted = (self._fitted(*_begun(self.propagator, self.source, cut), cut) for cut in cuts)
        guess = min(fitted, key=lambda each: each.action)
        action = guess.action
        for _, known in self._known:
            if isinstance(known, ExtremalPath) and known.flat and same_action(known.action, action, _FITTED):
                return known
        try:
            found = self._descended(guess)
            action = found.action
            return self._once(found)
        except StructureError as failure:
            hopeless = isinstance(failure, NotConverged) and failure.misfit > TOLERANCES.hopeful
            if effort < Effort.FROM_ORBIT or hopeless or not action < (1 - _FITTED) * least:
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
        """A path that starts on the orbit itself: the longest that converges, or hardly costs more than a longer one.

        Raises the failure if none converges. What its length changes is in its certificate.
        """
        best, failures, propagator, cut = None, 0, self.propagator, guess.cut
        source = self.source.with_start_on_orbit()
        if source is None:
            raise failure
        for intervals in _ON_ORBIT:
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
                if best is not None or failures == _FAILURES:
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
    of_family = one.flat and other.flat
    alike = one.source.node(one.first) == other.source.node(other.first) and len(one.points) == len(other.points)
    return (of_family or alike) and same_action(one.action, other.action)


def _begun(propagator: SegmentPropagator, source: LinearizedOrbit, cut: Cut) -> tuple[LinearizedOrbit, int, Array]:
    """The source, the phase there, and the states of a candidate from where it last is near the source.

    The start stays on the orbit until multiple shooting: the linearized equations do not hold for a start far from the
    orbit, and would give it much too small an action.
    """
    states = cut.states
    nodes = np.arange(0, len(states) - 1, propagator.grain)
    closest, places = source.nearest(states[nodes], nodes)
    wanted = _NEAR * float(np.linalg.norm(np.ptp(states, axis=0) / propagator.units))
    near = np.flatnonzero(closest <= wanted)
    entered = int(near[-1]) if near.size else 0
    (source, first), states = source.starting(places[entered]), states[nodes[entered] :]
    if not near.size:
        periods = math.ceil(math.log(closest[0] / wanted) / (source.slowest_rate * propagator.pieces))
        added = min(periods, _MOST_ADDED) * propagator.pieces
        first -= added
        states = np.concatenate([source.along(first, added), states])
    return source, first, np.concatenate([source.along(first, 1), states[1:]])
