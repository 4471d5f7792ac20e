"""CandidatePolisher: candidates of one attractor, polished to the ends that they come near, with rising effort."""

from __future__ import annotations

import contextlib
from collections import defaultdict
from collections.abc import Iterable, Sequence

import numpy as np

from vibrokit.analyzers.path_ends import PathEnd
from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.polishing.ends import Nodes
from vibrokit.analyzers.polishing.leg import Departure, LegSolver, SolvedPath
from vibrokit.analyzers.polishing.passing import PassingSearch
from vibrokit.analyzers.polishing.path_solver import Effort
from vibrokit.analyzers.polishing.tolerances import TOLERANCES
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.errors import StructureError
from vibrokit.results.codes import Code
from vibrokit.results.finding import Finding
from vibrokit.structure.orbits import Orbit


class CandidatePolisher:
    """Polishes candidates that leave one orbit, by default the attractor itself, and keeps each path once.

    Raises StructureError if the orbit is not hyperbolic, or if the attractor is none and no other is given.
    """

    def __init__(self, nodes: Nodes, ends: Sequence[PathEnd], orbit: Orbit | None = None) -> None:
        self.problem, self.ends, self.nodes = nodes.problem, ends, nodes
        self.solved: list[SolvedPath] = []
        self.skipped = 0  # candidates that cost too much
        self.findings: list[Finding] = []
        self._solver = LegSolver(self.nodes, _left(nodes.problem, orbit))
        self._passing = PassingSearch(self.nodes)
        self._near: dict[Candidate, list[PathEnd]] = {}  # the ends that each comes near
        self._unsolved: dict[Candidate, Effort] = {}  # the effort with which each did not lead to some end
        self._failed: defaultdict[PathEnd, list[Candidate]] = defaultdict(list)  # with all effort

    def polish(self, candidate: Candidate, effort: Effort) -> None:
        """Polish a candidate to each end that it comes near, unless a far cheaper path is known.

        Without momenta it is at least brought to descend. A candidate of a grid may pass an orbit on its way to an end.
        No path does that in finite time, so that it is polished in legs first. If it leads to no path to
        some end, it is left for `polish_the_rest`.
        """
        effort = effort if candidate.momenta is not None else max(effort, Effort.DESCEND)
        self._unsolved.pop(candidate, None)
        try:
            if candidate not in self._near:
                self._near[candidate] = self._ends_near(candidate)
            if candidate.action > TOLERANCES.worth * self._known(candidate):
                self.skipped += 1
                return
            failures, solved = self._tried(candidate, effort)
        except StructureError as error:  # nothing can be done for it
            effort, failures, solved = Effort.FROM_ORBIT, [str(error)], False
        if failures and effort < Effort.FROM_ORBIT:
            self._unsolved[candidate] = effort
        elif failures and not solved:
            self.findings.append(
                Finding.of(
                    Code.CANDIDATE_FAILED, self.problem.source, candidate.target,
                    action=candidate.action, finder=candidate.finder, reason=failures[0],
                )
            )  # fmt: skip

    def _tried(self, candidate: Candidate, effort: Effort) -> tuple[list[str], bool]:
        """Why a candidate leads to no path to some end, and whether it leads to another one, or is not wanted."""
        failures, solved = list[str](), False
        for end in self._near[candidate]:
            in_legs = self._solve_in_legs(end, candidate)
            if (in_legs and self._failed[end]) or not self._is_wanted(end, candidate):
                solved = True
                continue
            failure = self._solve(end, candidate, effort)
            failures += [failure] if failure else []
            solved |= in_legs or not failure
        leading = self._leading(candidate)
        if np.isinf(self._least(leading)):
            with contextlib.suppress(StructureError):  # one of them is not hyperbolic
                for end in sorted(leading, key=lambda end: self.nodes.distance(end, candidate)):
                    if self._solve_in_legs(end, candidate):
                        break
        return failures if failures or solved else ["it comes near no end."], solved

    def polish_the_rest(self, effort: Effort) -> None:
        """Polish what led to no path to some end with less effort.

        Only those that cost less than a known path are; a shot may cost more, as it does than the path near it, but
        with all effort it may not either.
        """
        for candidate in sorted(self._unsolved, key=lambda each: each.action):
            may_cost_more = candidate.momenta is not None and effort < Effort.FROM_ORBIT
            if self._unsolved[candidate] < effort and (may_cost_more or candidate.action < self._known(candidate)):
                self.polish(candidate, effort)

    def reach(self, end: PathEnd, effort: Effort) -> None:
        """Polish candidates to an end that none led to: the cheapest one that comes near it, then the cheapest one."""
        if any(one.end is end or (end.one_of_many and set(one.end.targets) & set(end.targets)) for one in self.solved):
            return
        ranked = sorted(self._near, key=lambda each: each.action)
        near = [each for each in ranked if end in self._near[each]]
        for candidate in dict.fromkeys((*near[:1], *ranked[:1])):
            if self._is_wanted(end, candidate) and not self._solve(end, candidate, effort):
                return

    def _solve(self, end: PathEnd, candidate: Candidate, effort: Effort) -> str:
        """Polish a candidate to an end; return why it leads to no path, or an empty text."""
        others = [other for other in self.ends if other is not end]
        try:
            leg = self._solver.solve(end, candidate, effort, others, self._least((end,)))
            self._add(SolvedPath.of(self.problem, (leg,), candidate.finder))
        except StructureError as error:
            self._failed[end] += [candidate] if effort is Effort.FROM_ORBIT else []
            return str(error)
        return ""

    def _add(self, one: SolvedPath) -> None:
        if not any(one.is_same(other) for other in self.solved):
            self.solved.append(one)

    def _known(self, candidate: Candidate) -> float:
        """The least action of a known path to the candidate's target, or, if less, to all ends that it comes near.

        It is infinite for a candidate that must pass those ends, since none of them leads to its target.
        """
        near, leading = self._near[candidate], self._leading(candidate)
        to_target = self._least({*leading, *(end for end in self.ends if candidate.target in end.targets)})
        if np.isinf(to_target) and leading and not set(leading) & set(near):
            return np.inf
        return min(to_target, max((self._least((end,)) for end in near), default=np.inf))

    def _leading(self, candidate: Candidate) -> list[PathEnd]:
        """The saddles, of paths through other orbits too, that lead to the target of a candidate."""
        return [end for end in self._passing.ends if candidate.target in end.targets]

    def _is_wanted(self, end: PathEnd, candidate: Candidate) -> bool:
        """Whether to look for a path to an end: not after six failures, nor inside a set if others cost less.

        A candidate that is cheaper than all that failed, as of a finer graph, is tried all the same.
        """
        failed = self._failed[end]
        known = any(one.end is end for one in self.solved)
        cheapest = min((each.action for each in failed), default=np.inf)
        if candidate in failed or (len(failed) >= 6 and not known and candidate.action >= cheapest):
            return False
        others = (other for other in self.ends if set(other.targets) & set(end.targets))
        return not end.one_of_many or candidate.action < self._least(others)

    def _least(self, ends: Iterable[PathEnd]) -> float:
        """The least action of the known paths to some ends; infinite if there is none."""
        among = tuple(ends)
        return min((one.action for one in self.solved if one.end in among), default=np.inf)

    def _ends_near(self, candidate: Candidate) -> list[PathEnd]:
        """The ends up to three times as far from a candidate as the nearest, two at most inside a chaotic set."""
        distances = [self.nodes.distance(end, candidate) for end in self.ends]
        order = [int(number) for number in np.argsort(distances) if np.isfinite(distances[number])]
        near = [self.ends[number] for number in order if distances[number] <= 3.0 * distances[order[0]]]
        inside = [end for end in near if end.one_of_many]
        return [end for end in near if end not in inside[2:]]

    def _solve_in_legs(self, end: PathEnd, candidate: Candidate) -> bool:
        """Whether a path to an end through an orbit that a candidate passes is known, or found and added."""
        if candidate.momenta is not None:  # it is one extremal path
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
