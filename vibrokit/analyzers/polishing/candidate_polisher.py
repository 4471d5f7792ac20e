"""CandidatePolisher: candidates of one attractor, the cheapest first, polished to the ends that they come near."""

from __future__ import annotations

import contextlib
import itertools
from collections import defaultdict
from collections.abc import Iterable, Sequence

import numpy as np

from vibrokit.analyzers.path_ends import PathEnd
from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.polishing.leg import Departure, LegSolver, Nodes, Way
from vibrokit.analyzers.polishing.passing import PassingSearch
from vibrokit.analyzers.polishing.path_solver import PathSolver
from vibrokit.analyzers.polishing.solved_path import SolvedPath
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.errors import StructureError
from vibrokit.results.codes import Code
from vibrokit.results.finding import Finding
from vibrokit.structure.orbits import Orbit

WORTH = 1.25
"""Times the least action known: costlier candidates are skipped. Searches price a path to a few percent."""
_NEAR = 3.0  # times the distance to the nearest end: other ends that near are tried too
_INSIDE = 2  # orbits inside a chaotic set that a candidate is polished to, the nearest ones
_QUICKLY = 0.0  # for the least action known: no finer pieces where the coarser ones do not converge
_MOST_FAILURES = 6  # candidates that lead to no path to an end, after which no other one is tried
_CHEAPER = 0.95  # times the least action that failed
_TRIES = 2  # candidates for an end that the cheaper ones do not lead to


class CandidatePolisher:
    """Polishes candidates that leave one orbit, by default the attractor itself, and keeps each path once.

    Raises StructureError if the orbit is not hyperbolic, or if the attractor is none and no other is given.
    """

    def __init__(self, problem: ExitProblem, ends: Sequence[PathEnd], orbit: Orbit | None = None) -> None:
        self.problem, self.ends = problem, ends
        self.nodes = Nodes(problem)
        self.solved: list[SolvedPath] = []
        self.skipped = 0  # candidates that cost too much
        self.findings: list[Finding] = []
        self._solver = LegSolver(self.nodes, _left(problem, orbit))
        self._passing = PassingSearch(self.nodes)
        self._failures: defaultdict[PathEnd, list[float]] = defaultdict(list)  # actions of candidates that led nowhere
        self._unsolved: list[Candidate] = []  # that led nowhere quickly
        self._beside: list[tuple[PathEnd, Candidate]] = []  # shots that led to a path; descent may find a cheaper one
        self._overpricing: dict[int, float] = {}  # by target: action of the first shot that led to a path, over its

    def polish(self, candidate: Candidate, *, quick: bool = False) -> None:
        """Polish a candidate to each end that it comes near, unless a far cheaper path is known.

        A candidate of a grid may pass an orbit on its way to an end. No path does that in finite time, so that it is
        polished in legs first. If it is polished quickly and no path is found, it is left for `polish_the_rest`.
        """
        if candidate.action > WORTH * self._known(candidate) * self._overpriced(candidate):
            self.skipped += 1
            return
        failures, solved = list[str](), False
        try:
            for end in self._near(candidate):
                in_legs = self._solve_in_legs(end, candidate)
                if (in_legs and self._failures[end]) or not self._is_wanted(end, candidate):
                    solved = True  # no failure of this candidate
                else:
                    solved |= self._solve_directly(end, candidate, failures, quick=quick) or in_legs
            for end in self._farther(candidate):
                if self._solve_in_legs(end, candidate):
                    break
        except StructureError as error:
            failures.append(str(error))
        if not solved and quick:
            self._unsolved.append(candidate)
        elif not solved:
            self.findings.append(
                Finding.of(
                    Code.CANDIDATE_FAILED, self.problem.source, candidate.target,
                    action=candidate.action, finder=candidate.finder, reason=(*failures, "it comes near no end.")[0],
                )
            )  # fmt: skip

    def polish_the_rest(self) -> None:
        """Polish what was left, then descend from shots that led to a path.

        A shot costs more than the path near it, a candidate of a grid may cost less: of these, only those that cost
        less than a known path.
        """
        unsolved, self._unsolved = self._unsolved, []
        for candidate in sorted(unsolved, key=lambda each: each.action):
            if candidate.momenta is not None or candidate.action < self._known(candidate):
                self.polish(candidate)
        beside, self._beside = self._beside, []
        for end, candidate in beside:
            with contextlib.suppress(StructureError):
                self._add(self._solve(end, candidate, PathSolver.solve, self._least((end,))))

    def _solve_directly(self, end: PathEnd, candidate: Candidate, failures: list[str], *, quick: bool) -> bool:
        """Whether a path to an end is found; by multiple shooting first where momenta are known."""
        at_once = PathSolver.solve_exact if candidate.exact else PathSolver.solve_at_once
        if candidate.momenta is None:
            ways: tuple[Way, ...] = (PathSolver.solve_near if quick else PathSolver.solve,)
        else:
            ways = (at_once,) if quick else (at_once, PathSolver.solve)
        for way in ways:
            try:
                one = self._solve(end, candidate, way, _QUICKLY if quick else self._least((end,)))
            except StructureError as error:
                failures.append(str(error))
                self._failures[end] += [] if quick else [candidate.action]
                continue
            if candidate.momenta is not None:
                self._overpricing.setdefault(candidate.target, max(1.0, candidate.action / one.action))
            if self._add(one) and way is at_once:
                self._beside.append((end, candidate))
            return True
        return False

    def reach(self, end: PathEnd, ranked: Sequence[Candidate], *, quick: bool = False) -> None:
        """Polish candidates to an end that none led to: those that come near it, then the cheapest one."""
        if any(one.end is end or (end.one_of_many and set(one.end.targets) & set(end.targets)) for one in self.solved):
            return
        way, least = (PathSolver.solve_near, _QUICKLY) if quick else (PathSolver.solve, self._least((end,)))
        near = list(itertools.islice((each for each in ranked if self._comes_near(end, each)), _TRIES))
        for candidate in (*near, *(each for each in ranked[:1] if each not in near)):
            if not self._is_wanted(end, candidate):
                return
            try:
                self._add(self._solve(end, candidate, way, least))
                return
            except StructureError:
                self._failures[end] += [] if quick else [candidate.action]

    def _add(self, one: SolvedPath) -> bool:
        """Whether a path is new; it is added then."""
        new = not any(one.is_same(other) for other in self.solved)
        if new:
            self.solved.append(one)
        return new

    def _known(self, candidate: Candidate) -> float:
        """The least action of a known path to the candidate's target, or, if less, to any end that it comes near.

        It is infinite for a candidate that must pass those ends, since none of them leads to its target.
        """
        try:
            near = self._near(candidate)
        except StructureError:
            near = []
        to_target = self._least(end for end in self._every if candidate.target in end.targets)
        if np.isinf(to_target) and self._passes(candidate, near):
            return np.inf
        return min(to_target, max((self._least((end,)) for end in near), default=np.inf))

    def _overpriced(self, candidate: Candidate) -> float:
        """By how much shots to its target cost more than the paths that they lead to, as the first one did.

        Between stiff stops, a path may cost a third less than the shot, and the next shot lead to another path.
        """
        return 1.0 if candidate.momenta is None else self._overpricing.get(candidate.target, 1.0)

    def _passes(self, candidate: Candidate, near: Iterable[PathEnd]) -> bool:
        """Whether only ends that are not near a candidate lead to its target."""
        leading = self._leading(candidate)
        return bool(leading) and not any(end in leading for end in near)

    def _leading(self, candidate: Candidate) -> list[PathEnd]:
        """The ends, of paths through other orbits too, that lead to the target of a candidate."""
        return [end for end in self._passing.ends if candidate.target in end.targets]

    def _is_wanted(self, end: PathEnd, candidate: Candidate) -> bool:
        """Whether to look for a path to an end: not after many failures, nor inside a set if others cost less.

        A candidate that is cheaper than all that failed, as of a finer graph, is tried all the same.
        """
        failed = self._failures[end]
        known = any(one.end is end for one in self.solved)
        if len(failed) >= _MOST_FAILURES and not known and candidate.action > _CHEAPER * min(failed):
            return False
        others = (other for other in self.ends if set(other.targets) & set(end.targets))
        return not end.one_of_many or candidate.action < self._least(others)

    def _least(self, ends: Iterable[PathEnd]) -> float:
        """The least action of the known paths to some ends; infinite if there is none."""
        among = tuple(ends)
        return min((one.action for one in self.solved if one.end in among), default=np.inf)

    @property
    def _every(self) -> list[PathEnd]:
        """The ends, and those that only paths through other orbits lead to."""
        return [*self.ends, *(end for end in self._passing.ends if end not in self.ends)]

    def _near(self, candidate: Candidate) -> list[PathEnd]:
        """The ends that a candidate comes near, the nearest first."""
        distances = [self.nodes.distance(end, candidate) for end in self.ends]
        order = [int(number) for number in np.argsort(distances) if np.isfinite(distances[number])]
        near = [self.ends[number] for number in order if distances[number] <= _NEAR * distances[order[0]]]
        inside = [end for end in near if end.one_of_many]
        return [end for end in near if end not in inside[_INSIDE:]]

    def _farther(self, candidate: Candidate) -> list[PathEnd]:
        """The ends that lead to the target of a candidate, the nearest first, if no path to the target is known."""
        ends = self._leading(candidate)
        if np.isfinite(self._least(ends)):
            return []
        return sorted(ends, key=lambda end: self.nodes.distance(end, candidate))

    def _comes_near(self, end: PathEnd, candidate: Candidate) -> bool:
        try:
            return end in self._near(candidate)
        except StructureError:
            return False

    def _solve(self, end: PathEnd, candidate: Candidate, way: Way, least: float) -> SolvedPath:
        others = [other for other in self.ends if other is not end]
        leg = self._solver.solve(end, candidate, others=others, least=least, way=way)
        return SolvedPath.of(self.problem, (leg,))

    def _solve_in_legs(self, end: PathEnd, candidate: Candidate) -> bool:
        """Whether a path to an end through an orbit that a candidate passes is known, or found and added."""
        if candidate.momenta is not None:  # a shot, which is one extremal path
            return False
        found = self._passing.solve(end, candidate, self.solved)
        if found is not None:
            self._add(found)
        return any(one.end is end and len(one.legs) > 1 for one in self.solved)


def _left(problem: ExitProblem, orbit: Orbit | None) -> Departure:
    """The orbit that paths leave."""
    attractor = problem.attractor
    if orbit is not None:
        return Departure(f"an orbit inside {attractor.name}", orbit.nodes, orbit.period, orbit.duration)
    if not attractor.repeats:
        raise StructureError(
            f"{attractor.name} is {attractor.kind}, and paths are polished from an orbit, an equilibrium or a limit "
            "cycle; give an unstable orbit inside it."
        )
    return Departure.from_attractor(attractor)
