"""CandidatePolisher: candidates of one attractor, the cheapest first, polished to the ends that they come near."""

from __future__ import annotations

import dataclasses
import functools
import itertools
from collections import Counter
from collections.abc import Callable, Iterable, Sequence

import numpy as np

from vibrokit.analyzers.path_ends import PathEnd
from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.polishing.ending import Cut, Ending, ResampledCandidate, resampled
from vibrokit.analyzers.polishing.ends import ending_at
from vibrokit.analyzers.polishing.extremal_path import ExtremalPath
from vibrokit.analyzers.polishing.linearize import linearized_orbit
from vibrokit.analyzers.polishing.path_solver import PathSolver
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.errors import StructureError
from vibrokit.kernels.single import record
from vibrokit.results.codes import Code
from vibrokit.results.energy import ExitPath
from vibrokit.results.finding import Finding
from vibrokit.structure.orbits import Orbit
from vibrokit.symbolic.flow_kind import Flow

WORTH = 1.25
"""Times the least action known: costlier candidates are skipped. Searches price a path to a few percent."""
PIECES = (8, 16)
"""In a section interval: the finer ones where the coarser ones do not converge."""
_NEAR = 3.0  # times the distance to the nearest end: other ends that near are tried too
_ROUNDS = 4  # how often a path is cut where it has already left
_CHEAPER = 1e-3  # of the least action known: a path that much cheaper is worth the costly fallback of `PathSolver`
_INSIDE = 2  # orbits inside a chaotic set that a candidate is polished to, the nearest ones
_MOST_FAILURES = 6  # candidates that lead to no path to an end, after which no other one is tried
_TRIES = 2  # candidates for an end that the cheaper ones do not lead to
_EQUAL = 1e-6  # relative difference of the actions of one path found twice
_SAMPLES = 128  # in a section interval: enough for pictures, and for quadrature to about 1e-6
_SAME = 0.05  # of a path's extent: distance between two paths that are one, one of them at its samples


Way = Callable[[PathSolver, Sequence[Cut], float], ExtremalPath]


@dataclasses.dataclass(frozen=True, eq=False)
class Solved:
    """A path to an end, at its nodes (`found`) and between them (`path`)."""

    end: PathEnd
    propagator: SegmentPropagator
    found: ExtremalPath
    path: ExitPath

    def is_same(self, other: Solved) -> bool:
        """Return whether two paths are one, shifted in time: of one action, and at one place where half is spent."""
        one, action = self.path, self.found.action
        if self.end is not other.end or abs(action - other.found.action) > _EQUAL * action:
            return False
        middle = min(int(np.searchsorted(one.action, 0.5 * action)), len(one.t) - 1)
        place = np.concatenate([one.q[middle], one.p[middle]])
        offsets = (np.hstack([other.path.q, other.path.p]) - place) / self.found.scale
        return bool(np.abs(offsets).max(axis=1).min() < _SAME)


class CandidatePolisher:
    """Polishes candidates that leave one orbit, by default the attractor itself, and keeps each path once.

    Raises StructureError if the orbit is not hyperbolic, or if the attractor is none and no other is given.
    """

    def __init__(self, problem: ExitProblem, ends: Sequence[PathEnd], orbit: Orbit | None = None) -> None:
        stepper = problem.single_stepper(Flow.HAMILTONIAN_VARIATIONAL)
        propagators = {pieces: SegmentPropagator(problem.scene, stepper, pieces) for pieces in PIECES}
        left = _left(problem, orbit)
        source = functools.cache(lambda pieces: linearized_orbit(propagators[pieces], *left))
        source(PIECES[0])
        self.problem, self.ends = problem, ends
        self.solved: list[Solved] = []
        self.skipped = 0  # candidates that cost too much
        self.findings: list[Finding] = []
        self._failures: Counter[PathEnd] = Counter()
        self._solver = functools.cache(lambda end, pieces: PathSolver(propagators[pieces], source(pieces)))
        self._ending = functools.cache(lambda end, pieces: ending_at(end, problem, propagators[pieces]))
        self._resampled = functools.cache(lambda candidate, pieces: resampled(propagators[pieces], candidate))

    def polish(self, candidate: Candidate) -> None:
        """Polish a candidate to each end that it comes near, unless a far cheaper path is known."""
        if candidate.action > WORTH * self._known(candidate):
            self.skipped += 1
            return
        failures, solved = [], False
        try:
            ways = (PathSolver.solve_at_once,) if candidate.momenta is not None else ()
            for end, way in itertools.product(self._near(candidate), (*ways, PathSolver.solve)):
                if not self._is_wanted(end, candidate):
                    solved = True  # no failure of this candidate
                    continue
                try:
                    self._add(self._solve(end, candidate, way))
                    solved = True
                except StructureError as error:
                    failures.append(str(error))
                    self._failures[end] += 1
        except StructureError as error:
            failures.append(str(error))
        if not solved:
            self.findings.append(
                Finding.of(
                    Code.CANDIDATE_FAILED, self.problem.source, candidate.target,
                    action=candidate.action, finder=candidate.finder, reason=(*failures, "it comes near no end.")[0],
                )
            )  # fmt: skip

    def reach(self, end: PathEnd, ranked: Sequence[Candidate]) -> None:
        """Polish candidates to an end that none led to: those that come near it, then the cheapest one."""
        if any(one.end is end or (end.one_of_many and set(one.end.targets) & set(end.targets)) for one in self.solved):
            return
        near = itertools.islice((each for each in ranked if self._comes_near(end, each)), _TRIES)
        for candidate in itertools.chain(near, ranked[:1]):
            if not self._is_wanted(end, candidate):
                return
            try:
                return self._add(self._solve(end, candidate))
            except StructureError:
                self._failures[end] += 1

    def _add(self, one: Solved) -> None:
        if not any(one.is_same(other) for other in self.solved):
            self.solved.append(one)

    def _known(self, candidate: Candidate) -> float:
        """The least action of a known path to the candidate's target, or, if less, to any end that it comes near."""
        try:
            near = self._near(candidate)
        except StructureError:
            near = []
        to_target = self._least(end for end in self.ends if candidate.target in end.targets)
        return min(to_target, max((self._least((end,)) for end in near), default=np.inf))

    def _is_wanted(self, end: PathEnd, candidate: Candidate) -> bool:
        """Whether to look for a path to an end: not after many failures, nor inside a set if others cost less."""
        if self._failures[end] >= _MOST_FAILURES and not any(one.end is end for one in self.solved):
            return False
        others = (other for other in self.ends if set(other.targets) & set(end.targets))
        return not end.one_of_many or candidate.action < self._least(others)

    def _least(self, ends: Iterable[PathEnd]) -> float:
        """The least action of the known paths to some ends; infinite if there is none."""
        among = tuple(ends)
        return min((one.found.action for one in self.solved if one.end in among), default=np.inf)

    def _near(self, candidate: Candidate) -> list[PathEnd]:
        """The ends that a candidate comes near, the nearest first."""
        nodes: ResampledCandidate = self._resampled(candidate, PIECES[0])
        distances = [self._ending(end, PIECES[0]).distance(nodes) for end in self.ends]
        order = [int(number) for number in np.argsort(distances) if np.isfinite(distances[number])]
        near = [self.ends[number] for number in order if distances[number] <= _NEAR * distances[order[0]]]
        inside = [end for end in near if end.one_of_many]
        return [end for end in near if end not in inside[_INSIDE:]]

    def _comes_near(self, end: PathEnd, candidate: Candidate) -> bool:
        try:
            return end in self._near(candidate)
        except StructureError:
            return False

    def _solve(self, end: PathEnd, candidate: Candidate, way: Way = PathSolver.solve) -> Solved:
        """Polish a candidate to an end, with finer pieces if necessary and if it is cheaper than all known paths."""
        least = self._least((end,))
        for pieces in PIECES:
            try:
                return self._solve_with(pieces, end, candidate, (1 - _CHEAPER) * least, way)
            except StructureError as error:
                failure = error
                if candidate.action >= least:
                    break
        raise failure

    def _solve_with(self, pieces: int, end: PathEnd, candidate: Candidate, worth: float, way: Way) -> Solved:
        solver: PathSolver = self._solver(end, pieces)
        ending: Ending = self._ending(end, pieces)
        for _ in range(_ROUNDS):
            found = way(solver, ending.cuts(self._resampled(candidate, pieces)), worth)
            if not found.action > 0:
                raise StructureError(f"the path has the action {found.action:.3g}, so it does not leave the attractor.")
            path = _dense_path(solver.propagator, found)
            if any(self._ending(other, pieces).crossing(path) is not None for other in self.ends if other is not end):
                raise StructureError("the path leaves by another face before its end.")
            left = ending.crossing(path)
            if left is None:
                return Solved(end, solver.propagator, found, path)
            inside = slice(left + 1)
            candidate = dataclasses.replace(
                candidate, times=path.t[inside], states=path.q[inside], momenta=path.p[inside]
            )  # fmt: skip
        raise StructureError(f"after {_ROUNDS} cuts where it has already left, the path still leaves before its end.")


def _left(problem: ExitProblem, orbit: Orbit | None) -> tuple[np.ndarray, int, float]:
    """A point of the orbit that paths leave, its period and its duration."""
    if orbit is not None:
        return orbit.point, orbit.period, orbit.duration
    attractor = problem.attractor
    if not attractor.repeats:
        raise StructureError(
            f"{attractor.name} is {attractor.kind}, and paths are polished from an orbit, an equilibrium or a limit "
            "cycle; give an unstable orbit inside it."
        )
    return attractor.points[0], attractor.period, attractor.duration


def _dense_path(propagator: SegmentPropagator, found: ExtremalPath) -> ExitPath:
    """Record a path piece by piece, each from its own node; the time is 0 at the start, which is on the section."""
    each, n, piece = _SAMPLES // propagator.pieces, propagator.size, propagator.piece
    lengths = np.append(np.full(len(found.points) - 2, piece), found.last)
    actions = found.head + np.concatenate([[0.0], np.cumsum(found.actions)])
    parts, times = [], []
    for node, length in enumerate(lengths):
        start = (found.first + node) % propagator.pieces * piece
        begin = np.append(found.points[node], actions[node])
        part = record(propagator.osc, Flow.HAMILTONIAN, propagator.stepper, begin, start, length / each, each)
        parts.append(part[:-1])
        times.append(node * piece + length / each * np.arange(len(part) - 1))
    z = np.vstack([*parts, np.append(found.points[-1], actions[-1])])
    t = np.concatenate([*times, [float(np.sum(lengths))]])
    section = np.arange(0, len(z) - (found.last != piece), _SAMPLES)
    return ExitPath(t, z[:, :n], z[:, n : 2 * n], z[:, -1], section)
