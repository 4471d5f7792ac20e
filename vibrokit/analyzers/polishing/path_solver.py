"""PathSolver: from a cut candidate to the extremal path between two orbits, or from an orbit to a face."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Sequence

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.paths.action_descent import FEW_ITERATIONS, MANY_ITERATIONS, descend_action
from vibrokit.analyzers.paths.gauss_newton import gauss_newton
from vibrokit.analyzers.paths.same_action import same_action
from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.polishing.completion import (
    FEWEST_NODES,
    MORE_PERIODS,
    RADIUS,
    completed,
    solved_again,
    within,
)
from vibrokit.analyzers.polishing.ending import Cut
from vibrokit.analyzers.polishing.extremal_path import ExtremalPath
from vibrokit.analyzers.polishing.linearized_orbit import LinearizedOrbit
from vibrokit.analyzers.polishing.newton import MOST_EVALUATIONS, NotConverged, extremal_path
from vibrokit.errors import StructureError

_NEAR = 1e-3  # of a path's extent: a candidate is cut where it last is this near to its source
LONG_ENOUGH = 1e-6
"""Relative change of the action by which a path is accepted that starts on its orbit, when it is made twice as long."""
_FROM_NEAR = 60  # evaluations for a candidate with momenta, or a longer path; those that converge need no more
_FROM_EXACT = 12  # for one that is a path but for its ends: those that converge need 3 to 6
_ON_ORBIT = (8, 16, 32, 64, 128)  # section intervals spent near the orbit by a path that starts on it
_FAILURES = 3  # of these in turn, after which no longer one is tried
_HOPEFUL = 0.02  # misfit up to which a path is solved for from the orbit; those that were found had up to 0.012
_MOST_LOST = 4  # paths that could not be solved for from the orbit either, after which that is no longer tried
_ROUGHLY_ACCEPTED = 1e-6  # misfit of a path that starts farther from its source than the final one
_NEARLY = 1e-4  # misfit of a path that may converge if it begins nearer to its source
_ONE_PATH = 1e-9  # relative difference of the actions of one path, of equal nodes
_FITTED, _SAME = 5e-3, 0.05  # of the action, and of a path's extent: accuracy of the Gauss–Newton method
_COMPARED = 512  # nodes of a path, at most, that are compared with another one
_MOST_ADDED = 1000  # section intervals before a candidate that starts far from its source

Array = NDArray[np.float64]
Fallback = Callable[[StructureError, float], ExtremalPath]


class PathSolver:
    """Solves for paths that leave one orbit; each path that several candidates lead to is completed once."""

    def __init__(self, propagator: SegmentPropagator, source: LinearizedOrbit) -> None:
        self.propagator, self.source = propagator, source
        self._known: list[tuple[ExtremalPath, ExtremalPath | StructureError]] = []
        self._failed: dict[Hashable, StructureError] = {}  # attempts, by where they began
        self._lost = 0  # paths that were not found from the orbit either

    def solve(self, cuts: Sequence[Cut], worth: float = np.inf) -> ExtremalPath:
        """Polish a candidate: by the Gauss–Newton method, by descent of the action, and by multiple shooting.

        Of several ways to cut the candidate, the cheapest after the Gauss–Newton method is taken. A path that cannot be
        joined to its source by the linearized equations is solved for as one that starts on the orbit itself, if its
        action is below `worth`; one that costs more descends in few iterations only. Raises StructureError if no
        extremal path is found near the candidate.
        """
        return self._solve(cuts, worth, from_orbit=True)

    def solve_near(self, cuts: Sequence[Cut], worth: float = np.inf) -> ExtremalPath:
        """Polish as `solve` does, whatever it is worth, but never from the orbit itself, which takes long."""
        return self._solve(cuts, np.inf, from_orbit=False)

    def _solve(self, cuts: Sequence[Cut], worth: float, *, from_orbit: bool) -> ExtremalPath:
        propagator, fitted = self.propagator, []
        for cut in cuts:
            source, first, points = _begun(propagator, self.source, cut)
            states = points[:, : propagator.size]
            fitted.append((*gauss_newton(propagator, first, states, cut.last, cut.ending.free), source, first, cut))
        points, action, source, first, cut = min(fitted, key=lambda each: each[1])
        for _, known in self._known:
            if isinstance(known, ExtremalPath) and _in_family(known, first, points, action):
                return known

        def fallback(failure: StructureError, known: float) -> ExtremalPath:
            hopeless = isinstance(failure, NotConverged) and failure.misfit > _HOPEFUL
            if hopeless or not from_orbit or not known < worth or self._lost >= _MOST_LOST:
                raise failure
            try:
                return self._from_orbit(first, cut, points, failure)
            except StructureError:
                self._lost += 1
                raise

        try:
            iterations = MANY_ITERATIONS if action < worth else FEW_ITERATIONS
            begun = "descent", first, iterations, cut.last, points.tobytes()
            found = self._attempted(begun, lambda: self._descended(source, first, cut, points, iterations))
        except StructureError as error:
            return fallback(error, action)
        return self._once(found, fallback, final=from_orbit)

    def solve_at_once(self, cuts: Sequence[Cut], worth: float = np.inf) -> ExtremalPath:
        """Polish a candidate with momenta by multiple shooting alone, cut where it ends itself.

        It stays at the candidate, while descent may end at a cheaper path; between stiff stops descent often fails.
        Raises StructureError if that does not converge.
        """
        return self._at_once(cuts[0], _FROM_NEAR)

    def solve_exact(self, cuts: Sequence[Cut], worth: float = np.inf) -> ExtremalPath:
        """Polish, as `solve_at_once` does, a candidate that is a path but for its ends: in few evaluations or not."""
        return self._at_once(cuts[0], _FROM_EXACT, nearly=0.0)

    def _at_once(self, cut: Cut, evaluations: int, nearly: float = _NEARLY) -> ExtremalPath:
        assert cut.momenta is not None
        source, first = self.source.starting(self.source.closest(cut.states[:1])[2])
        points = np.hstack([cut.states, cut.momenta])
        begun = "at once", first, evaluations, cut.last, points.tobytes()
        found = self._attempted(begun, lambda: self._shot(source, first, points, cut, evaluations, nearly))
        return self._once(found, _give_up)

    def _once(self, found: ExtremalPath, fallback: Fallback, *, final: bool = True) -> ExtremalPath:
        """Complete a path, unless that was done, or failed for good, before."""
        result = next((known for before, known in self._known if _are_one(before, found)), None)
        if result is None:
            try:
                result = self._completed(found, fallback)
            except StructureError as error:
                if not final:  # starting on the orbit may help later
                    raise
                result = error
            self._known.append((found, result))
        if isinstance(result, StructureError):
            raise result
        return result

    def _completed(self, found: ExtremalPath, fallback: Fallback) -> ExtremalPath:
        try:
            begun = "completion", found.first, found.points.tobytes()
            return self._attempted(begun, lambda: completed(self.propagator, found))
        except StructureError as error:
            return fallback(error, found.action)

    def _attempted(self, begun: Hashable, attempt: Callable[[], ExtremalPath]) -> ExtremalPath:
        """Do what did not fail before: candidates are tried quickly first, and again with all that is left."""
        if begun in self._failed:
            raise self._failed[begun]
        try:
            return attempt()
        except StructureError as error:
            self._failed[begun] = error
            raise

    def _descended(
        self,
        source: LinearizedOrbit,
        first: int,
        cut: Cut,
        points: Array,
        iterations: int = MANY_ITERATIONS,
        evaluations: int = MOST_EVALUATIONS,
    ) -> ExtremalPath:
        points, _ = descend_action(
            self.propagator, first, points,
            last=cut.last, free=cut.ending.free, closing=cut.ending.closing, iterations=iterations,
        )  # fmt: skip
        return self._shot(source, first, points, cut, evaluations)

    def _shot(
        self,
        source: LinearizedOrbit,
        first: int,
        points: Array,
        cut: Cut,
        evaluations: int = MOST_EVALUATIONS,
        nearly: float = _NEARLY,
    ) -> ExtremalPath:
        return extremal_path(
            self.propagator, source, first, cut.ending, points, cut.last,
            evaluations=evaluations, accepted=_ROUGHLY_ACCEPTED, nearly=nearly,
        )  # fmt: skip

    def _from_orbit(self, first: int, cut: Cut, points: Array, failure: StructureError) -> ExtremalPath:
        """A path that starts on the orbit itself: the longest that converges, or hardly costs more than a longer one.

        Raises the failure if none converges. What its length changes is in its certificate.
        """
        best, failures, propagator = None, 0, self.propagator
        source = self.source.with_start_on_orbit()
        if source is None:
            raise failure
        for intervals in _ON_ORBIT:
            added = intervals * propagator.pieces
            states = np.concatenate([source.along(first - added, added), points[:, : propagator.size]])
            try:
                longer, _ = gauss_newton(propagator, first - added, states, cut.last, cut.ending.free)
                evaluations = MOST_EVALUATIONS if best is None else _FROM_NEAR
                found = self._descended(source, first - added, cut, longer, evaluations=evaluations)
                found = within(propagator, found, RADIUS * found.extent)
                solved_again(propagator, found, MORE_PERIODS * source.period_nodes, 0)
            except StructureError:
                failures += 1
                if best is not None or failures == _FAILURES:
                    break
                continue
            if best is not None and abs(found.action - best.action) <= LONG_ENOUGH * best.action:
                break
            best = found
        if best is None:
            raise failure
        return best


def _give_up(failure: StructureError, action: float) -> ExtremalPath:
    raise failure


def _are_one(one: ExtremalPath, other: ExtremalPath) -> bool:
    """Return whether two paths, each polished once, are one, or of one family."""
    if one.flat and other.flat:
        alike = _in_family(one, other.first, other.points, other.action)
        return alike and same_action(one.action, other.action)
    alike = one.source.node(one.first) == other.source.node(other.first) and len(one.points) == len(other.points)
    return alike and same_action(one.action, other.action, _ONE_PATH)


def _in_family(known: ExtremalPath, first: int, points: Array, action: float) -> bool:
    """Return whether a path of a given action, as exact as of the Gauss–Newton method, is of the family of a known one.

    On the section, the states of all members lie on one line.
    """
    if not known.flat or not same_action(known.action, action, _FITTED):
        return False
    pieces = known.ending.propagator.grain
    line, own = (
        nodes[-number % pieces :: pieces, : len(known.scale) // 2] / known.scale[: len(known.scale) // 2]
        for nodes, number in ((known.points, known.first), (points, first))
    )
    if not len(own) or len(line) < FEWEST_NODES:
        return False
    starts, ways = line[:-1], np.diff(line, axis=0)
    lengths = np.maximum((ways**2).sum(axis=1), 1e-300)
    for state in own[np.linspace(0, len(own) - 1, min(len(own), _COMPARED)).astype(np.int64)]:
        along = np.clip(((state - starts) * ways).sum(axis=1) / lengths, 0, 1)
        if np.linalg.norm(state - starts - along[:, None] * ways, axis=1).min() >= _SAME:
            return False
    return True


def _begun(propagator: SegmentPropagator, source: LinearizedOrbit, cut: Cut) -> tuple[LinearizedOrbit, int, Array]:
    """Points (q, p) of a candidate that starts on its source, where it last is near or long before its first state.

    They come with the source and the phase there.

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
    states = np.concatenate([source.along(first, 1), states[1:]])
    return source, first, np.hstack([states, np.zeros_like(states)])
