"""Polish: all candidates of one attractor, each exit path once, ranked and certified."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

from vibrokit.analyzers.path_ends import PathEnd
from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.paths.same_action import same_action
from vibrokit.analyzers.polishing.candidate_polisher import WORTH, CandidatePolisher
from vibrokit.analyzers.polishing.certify import certify
from vibrokit.analyzers.polishing.ends import usable_ends
from vibrokit.analyzers.polishing.path_solver import LONG_ENOUGH
from vibrokit.analyzers.polishing.sensitivity import sensitivities
from vibrokit.analyzers.polishing.solved_path import SolvedPath
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.errors import StructureError
from vibrokit.progress import advance, stage
from vibrokit.results.codes import Code
from vibrokit.results.energy import ActivationEnergy, Bound, Certificate, upper_bound
from vibrokit.results.finding import Finding
from vibrokit.results.labels import goal_name
from vibrokit.results.stoppable import Stoppable
from vibrokit.structure.orbits import Orbit

METHOD = "least action"
_COMPETING = 0.01  # of the least action: at ΔU/D = 100 such a path still carries a third as many exits
_FLAT = 1e-3  # sine of the angle between the manifolds
_ROUNDING = 1e-12  # of an action, which is a sum of thousands of terms
_ORBITS = 2  # inside an attractor from which paths are polished to ends that no candidate led to
_UNRESOLVED = 0.01  # of a candidate's action: where its path costs less, the action was an error of the search
_EQUAL = 1e-5  # relative difference of the actions of paths that differ only in where inside a set they start


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
    fruitless: set[tuple[int, bytes]] = dataclasses.field(default_factory=set)  # candidates
    free: set[int] = dataclasses.field(default_factory=set)  # labels of attractors that paths cost next to nothing to

    def note(self, candidate: Candidate, found: Sequence[SolvedPath], number: int) -> None:
        """Note what a candidate has led to from the orbit of a number, 0 for the first."""
        unresolved = [one for one in found if one.action < _UNRESOLVED * candidate.action]
        for one in unresolved:
            self.free |= set(one.targets)
        if unresolved or (number and not any(map(self.is_new, found))):
            self.fruitless.add(_key(candidate))

    def wants(self, end: PathEnd, number: int) -> bool:
        """Whether to look for a path to an end that no candidate led to, from the orbit of a number."""
        return number < _ORBITS and not (number and self.free >= set(end.targets))

    def is_new(self, one: SolvedPath) -> bool:
        """Whether no orbit has led to the same path, as far as its beginning does not matter."""
        alike = (other for other in self.solved if other.end is one.end)
        return not any(same_action(other.action, one.action, _EQUAL) for other in alike)


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
            self._ends, self._findings = usable_ends(problem)
            self._polisher = CandidatePolisher(problem, self._ends, orbit)
        self._number = self._shared.orbits
        self._shared.orbits += 1
        self._branches: list[ActivationEnergy] = []
        self._certified = self._tried = 0
        self.complete = True
        self._seen = set[tuple[int, bytes]]()
        self._waiting: list[Candidate] = []  # for a call that is not quick, which tries to reach all ends

    def add(self, candidates: Sequence[Candidate], *, quick: bool = False) -> None:
        """Polish candidates, the cheapest first, and certify the paths that they lead to.

        Those that came before are left out: finer graphs give some paths again. Shots are polished quickly first. What
        leads to no path quickly is polished at the end, or left for the next call, after the candidates of that one.
        """
        new = {_key(each): each for each in candidates}
        ranked = sorted((new[key] for key in new if key not in self._seen), key=lambda each: each.action)
        self._seen |= new.keys()
        self._tried += len(ranked)
        source, certified = self._problem.source, 0
        with Stoppable("polishing", source) as polishing, stage("polishing", unit="candidates", total=len(ranked)):
            for candidate in ranked:
                if _key(candidate) not in self._shared.fruitless:
                    before = len(self._polisher.solved)
                    self._polisher.polish(candidate, quick=quick or candidate.momenta is not None)
                    self._shared.note(candidate, self._polisher.solved[before:], self._number)
                advance()
            self._waiting = sorted((*self._waiting, *ranked), key=lambda each: each.action)
            if not quick:
                self._reach_all(quick=True)  # so that candidates that cost more need no costly polishing
                self._polisher.polish_the_rest()
                self._reach_all()
                self._waiting = []
        found = self._new()
        self._certified = len(self._polisher.solved)
        with Stoppable("certifying", source) as certifying, stage("certifying", unit="paths", total=len(found)):
            for solved in found:
                self._branches += _certified(self._problem, solved, self._findings)
                certified += 1
                advance()
        for solved in found[certified:]:
            self._findings += _remarks(self._problem, solved)
            self._branches += _energies(self._problem, solved)
        self._findings += (*polishing.findings, *certifying.findings)
        self.complete = self.complete and not (polishing.stopped or certifying.stopped)

    def _reach_all(self, *, quick: bool = False) -> None:
        """Look for paths to the ends that no candidate led to; quickly for those that are not one of many in a set."""
        for end in self._ends:
            if self._shared.wants(end, self._number) and not (quick and end.one_of_many):
                self._polisher.reach(end, self._waiting, quick=quick)

    def _new(self) -> list[SolvedPath]:
        """The paths that were solved for since the last call, without those that another orbit has led to."""
        found = self._polisher.solved[self._certified :]
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
            values = {"skipped": skipped, "total": self._tried, "factor": WORTH}
            findings.append(Finding(Code.CANDIDATES_SKIPPED, self._problem.source, values=values))
        branches = sorted(self._branches, key=lambda branch: branch.value)
        return Polished(tuple(branches), (*findings, *_valleys(branches)))


def _key(candidate: Candidate) -> tuple[int, bytes]:
    return candidate.target, candidate.states.tobytes()


def _certified(problem: ExitProblem, solved: SolvedPath, findings: list[Finding]) -> list[ActivationEnergy]:
    """The energies of a path with its certificate, or without if that fails."""
    source, action = problem.source, solved.action
    findings += _remarks(problem, solved)
    try:
        certificates = [certify(leg.propagator, leg.found) for leg in solved.legs]
    except StructureError as failure:
        findings.append(Finding.of(Code.NO_CERTIFICATE, source, action=action, reason=str(failure)))
        return _energies(problem, solved)
    certificate = Certificate.combined(certificates)
    if not certificate.error <= action:
        reason = f"its action changes by {certificate.error:.2g} when its beginning, length and integration do."
        findings.append(Finding.of(Code.NO_CERTIFICATE, source, action=action, reason=reason))
        return _energies(problem, solved, error=certificate.error)
    if any(leg.found.source.start_on_orbit for leg in solved.legs):
        findings.append(Finding.of(Code.STARTS_ON_ORBIT, source, action=action, periods=certificate.periods))
    derivatives = [sensitivities(problem, leg.end, leg.propagator, leg.found) for leg in solved.legs]
    names = [name for name in derivatives[0] if all(name in each for each in derivatives)]
    return _energies(
        problem,
        solved,
        error=certificate.error + _ROUNDING * action,
        residual=certificate.residual,
        certificate=certificate,
        sensitivity={name: sum(each[name].value for each in derivatives) for name in names},
        sensitivity_error={name: sum(each[name].error for each in derivatives) for name in names},
    )


def _remarks(problem: ExitProblem, solved: SolvedPath) -> list[Finding]:
    """What a path passes, and where its end leads."""
    found = [
        Finding.of(Code.PASSES_ORBITS, problem.source, target, action=solved.action, through=list(solved.through))
        for target in solved.targets
        if solved.through
    ]
    if len(solved.targets) > 1:
        goals = [goal_name(problem.structure.names, label) for label in solved.targets]
        found.append(Finding.of(Code.ONE_SADDLE_TO_SEVERAL, problem.source, saddle=solved.end.saddle, goals=goals))
    return found


def _energies(
    problem: ExitProblem, solved: SolvedPath, *, error: float | None = None, **evidence: Any
) -> list[ActivationEnergy]:
    """The energy of a path, once for each attractor that it leads to.

    Without a certificate, the error is the change by which the path was accepted as long enough.
    """
    action = solved.action
    error = LONG_ENOUGH * action if error is None else error
    known = {"residual": max(max(leg.found.residual, leg.found.slack) for leg in solved.legs)} | evidence
    return [
        ActivationEnergy(
            source=problem.source,
            target=target,
            value=action,
            lower=0.0,
            upper=upper_bound(action, error),
            method=METHOD,
            bound=Bound.BRACKET if solved.end.one_of_many else Bound.UPPER,
            numerical_error=error,
            path=solved.path,
            saddle=solved.end.saddle,
            **known,
        )
        for target in solved.targets
    ]


def _valleys(branches: Sequence[ActivationEnergy]) -> list[Finding]:
    """Findings where exits are not confined to one path."""
    if not branches:
        return []
    best, findings = branches[0], []
    limit = (1 + _COMPETING) * best.value
    paths = {id(branch.path): branch for branch in branches if branch.value <= limit}  # one may lead to several
    alike = [branch.value for branch in paths.values() if branch.path is not best.path]
    if alike:
        percent = 100 * _COMPETING
        findings.append(
            Finding.of(
                Code.COMPETING_PATHS, best.source, best.target, percent=percent, least=best.value, actions=alike
            )
        )  # fmt: skip
    sine = 1.0 if best.certificate is None else best.certificate.transversality
    if sine < _FLAT:
        findings.append(Finding.of(Code.FLAT_VALLEY, best.source, best.target, sine=sine))
    return findings
