"""Polish: all candidates of one attractor, each exit path once, ranked and certified."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from vibrokit.analyzers.path_ends import PathEnd
from vibrokit.analyzers.paths.candidate import Candidate, same_action
from vibrokit.analyzers.polishing import certified
from vibrokit.analyzers.polishing.candidate_polisher import CandidatePolisher
from vibrokit.analyzers.polishing.ends import Nodes
from vibrokit.analyzers.polishing.leg import SolvedPath
from vibrokit.analyzers.polishing.path_solver import Effort
from vibrokit.analyzers.polishing.tolerances import TOLERANCES
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.progress import advance, stage
from vibrokit.results.codes import Code
from vibrokit.results.energy import ActivationEnergy
from vibrokit.results.finding import Finding
from vibrokit.results.stoppable import Stoppable
from vibrokit.structure.orbits import Orbit

_ORBITS = 2  # inside an attractor from which paths are polished to ends that no candidate led to
_UNRESOLVED = 0.01  # of a candidate's action: where its path costs less, the action was an error of the search


@dataclasses.dataclass(frozen=True, eq=False)
class Polished:
    """What the candidates of one attractor led to."""

    branches: tuple[ActivationEnergy, ...]  # each path once for each attractor that it leads to, the cheapest first
    findings: tuple[Finding, ...]


@dataclasses.dataclass(eq=False)
class Shared:
    """What the paths from several orbits inside one attractor share.

    A candidate is polished from two orbits, and from another one as long as it leads to something new: motion inside
    the attractor is free, so that most paths differ in their beginnings only. Where a path costs next to nothing, so do
    those from other orbits, which can take long to converge; no other one is tried.
    """

    orbits: int = 0
    solved: list[SolvedPath] = dataclasses.field(default_factory=list)  # those kept
    fruitless: set[Candidate] = dataclasses.field(default_factory=set)
    free: set[int] = dataclasses.field(default_factory=set)  # labels of attractors that paths cost next to nothing to

    def note(self, candidate: Candidate, found: Sequence[SolvedPath], number: int) -> None:
        """Note what a candidate has led to from the orbit of a number, 0 for the first."""
        unresolved = [one for one in found if one.action < _UNRESOLVED * candidate.action]
        for one in unresolved:
            self.free |= set(one.targets)
        if unresolved or (number and not any(map(self.is_new, found))):
            self.fruitless.add(candidate)

    def wants(self, end: PathEnd, number: int) -> bool:
        """Whether to look for a path to an end that no candidate led to, from the orbit of a number."""
        return number < _ORBITS and not (number and self.free >= set(end.targets))

    def is_new(self, one: SolvedPath) -> bool:
        """Whether no orbit has led to the same path, as far as its beginning does not matter."""
        return not any(other.end is one.end and same_action(other.action, one.action) for other in self.solved)


def polish(problem: ExitProblem, candidates: Sequence[Candidate], orbit: Orbit | None = None) -> Polished:
    """Polish candidates to certified exit paths; arguments and errors as of `Polishing`."""
    work = Polishing(problem, orbit)
    work.add(candidates)
    return work.polished()


class Polishing:
    """Exit paths of one attractor with their certificates, from candidates that may come one search after another.

    If it is stopped, by Ctrl-C or by the time limit, the paths found so far are kept, with the certificates that were
    finished. A path whose certificate fails is kept without.

    For an attractor that is not an orbit, `orbit` is an unstable one inside it; an exit from there costs at least as
    much as leaving the attractor. Several of them may share what they lead to. Raises StructureError if no orbit is
    given, or if it is not hyperbolic, and StepperError if the stepper cannot integrate Hamilton's equations of this
    scene.

    Attributes
    ----------
    complete : bool
        Whether no part of it was stopped so far.
    """

    def __init__(self, problem: ExitProblem, orbit: Orbit | None = None, shared: Shared | None = None) -> None:
        self._problem, self._shared = problem, shared or Shared()
        with stage("ends of exit paths", subject=problem.attractor.name):
            nodes = Nodes(problem)
            self._ends, self._findings = nodes.usable()
            self._polisher = CandidatePolisher(nodes, self._ends, orbit)
        self._number = self._shared.orbits
        self._shared.orbits += 1
        self._branches: list[ActivationEnergy] = []
        self._seen = set[Candidate]()
        self._certified = 0  # of the polisher's paths
        self.complete = True

    def add(self, candidates: Sequence[Candidate], effort: Effort = Effort.FROM_ORBIT) -> None:
        """Polish candidates, the cheapest first, and certify the paths that they lead to.

        All are tried with little effort first. Then more is done, up to `effort`, for those that led to no path and for
        ends that no candidate led to. A later call with more effort tries them again.
        """
        new = (each for each in dict.fromkeys(candidates) if each not in self._seen)
        ranked = sorted(new, key=lambda each: each.action)
        self._seen |= set(ranked)
        with Stoppable("polishing", self._problem.source) as work:
            self._polish(ranked)
            for rung in range(Effort.DESCEND, effort + 1):
                self._polish_the_rest(Effort(rung))
        self._findings += work.findings
        self.complete &= not work.stopped
        self._certify()

    def _polish(self, ranked: Sequence[Candidate]) -> None:
        with stage("polishing", unit="candidates", total=len(ranked)):
            for candidate in ranked:
                if candidate not in self._shared.fruitless:
                    before = len(self._polisher.solved)
                    self._polisher.polish(candidate, Effort.SHOOT)
                    self._shared.note(candidate, self._polisher.solved[before:], self._number)
                advance()

    def _polish_the_rest(self, effort: Effort) -> None:
        """Look for paths to ends without one first, so that candidates that cost more are skipped.

        Those to ends inside a set are looked for with all effort only.
        """
        for end in self._ends:
            if self._shared.wants(end, self._number) and (effort is Effort.FROM_ORBIT or not end.one_of_many):
                self._polisher.reach(end, effort)
        self._polisher.polish_the_rest(effort)

    def _certify(self) -> None:
        """Certify the paths that were solved for since the last call; those after a stop are kept without."""
        found, count = self._new(), 0
        with Stoppable("certifying", self._problem.source) as work, stage("certifying", unit="paths", total=len(found)):
            for solved in found:
                self._branches += certified.certified(self._problem, solved, self._findings)
                count += 1
                advance()
        for solved in found[count:]:
            self._findings += certified.remarks(self._problem, solved)
            self._branches += certified.energies(self._problem, solved)
        self._findings += work.findings
        self.complete &= not work.stopped

    def _new(self) -> list[SolvedPath]:
        """The paths that were solved for since the last call, without those that another orbit has led to."""
        found = self._polisher.solved[self._certified :]
        self._certified = len(self._polisher.solved)
        if self._shared.orbits == 1:
            return found
        new = list[SolvedPath]()
        for one in found:
            if self._shared.is_new(one):
                self._shared.solved.append(one)
                new.append(one)
        return new

    def polished(self) -> Polished:
        """Return what all candidates led to."""
        findings, skipped = [*self._findings, *self._polisher.findings], self._polisher.skipped
        if skipped:
            values = {"skipped": skipped, "total": len(self._seen), "factor": TOLERANCES.worth}
            findings.append(Finding(Code.CANDIDATES_SKIPPED, self._problem.source, values=values))
        branches = sorted(self._branches, key=lambda branch: branch.value)
        return Polished(tuple(branches), (*findings, *certified.valleys(branches)))
