"""ExitRoad: how the exits of one attractor are solved. Sources propose, polishing solves, the graph bounds."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
from collections.abc import Callable, Iterable, Sequence
from functools import cached_property

import xarray

from vibrokit.analyzers.agreement import Evidence, reached_through_others
from vibrokit.analyzers.analyzer import Analysis
from vibrokit.analyzers.graph.beginnings import beginnings
from vibrokit.analyzers.graph.known_paths import KnownPaths
from vibrokit.analyzers.graph.solution import GraphSolution
from vibrokit.analyzers.paths import detailed_balance, without_memory
from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.polishing.path_solver import Effort
from vibrokit.analyzers.polishing.polish import Polishing, Shared
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.analyzers.shooting.search import Search
from vibrokit.analyzers.sources import Graph, Shots, Source, check_proposal
from vibrokit.errors import OutOfTime, StepperError, StructureError, VibrokitError
from vibrokit.progress import stage
from vibrokit.results.codes import Code
from vibrokit.results.energy import ActivationEnergy, Bound
from vibrokit.results.finding import Finding
from vibrokit.results.stoppable import Stoppable
from vibrokit.structure.orbits import Orbit
from vibrokit.structure.unstable_orbits import orbits_inside
from vibrokit.symbolic.flow_kind import Flow


class ExitRoad:
    """The exits of one attractor: what is found by all sources, polished, and bounded by the graph among them.

    Parameters
    ----------
    problem : ExitProblem
    sources : sequence of Source
        In the order in which they propose.
    accuracy : float
        The relative error of the graph that suffices.
    orbits : int
        Number of orbits inside a chaotic attractor that paths are polished from.
    """

    def __init__(
        self, problem: ExitProblem, sources: Sequence[Source], *, accuracy: float = 0.1, orbits: int = 4
    ) -> None:
        self.problem, self.sources, self._accuracy, self._orbits = problem, sources, accuracy, orbits
        self._graph = next((source for source in sources if isinstance(source, Graph)), None)
        self._shots = next((source for source in sources if isinstance(source, Shots)), None)
        self._least = without_memory.least_actions(problem)
        self._polishings: list[Polishing] | None = None  # one for each orbit that paths leave; None before the first
        self._cut = False  # whether a step was stopped
        self._findings: list[Finding] = []

    def run(self) -> Analysis:
        """Propose, polish and bound, until the end, until all exits are proven, or until the work is stopped."""
        with Stoppable("", self.problem.source) as work:
            for number, source in enumerate(self.sources, 1):
                work.doing = source.name
                self._take(source)
                if self._is_over(self.sources[number:]):
                    break
            work.doing = "graph"
            for step in (self._refine, self._begin_otherwise):
                if not self._is_over():
                    step()
        self._findings += work.findings
        self._cut |= work.stopped
        return self.analysis()

    @property
    def stopped(self) -> bool:
        """Whether the work was stopped anywhere before its end."""
        parts = (self._search, *(self._polishings or ()))
        return self._cut or not all(part.complete for part in parts if part is not None)

    def analysis(self) -> Analysis:
        """Combine what was found."""
        (branches, polished), solution = self._polished, self.solution
        if solution is not None:
            solution = solution.bounded(self.problem, {branch.target for branch in branches})
            self._cut |= not solution.complete
        evidence = self._weighed(solution)
        exits = evidence.compared(self._unpolished(evidence))
        every = (*self._findings, *(() if solution is None else solution.findings), *polished)
        findings = [finding for finding in every if finding.code is not Code.NO_EXIT_FOUND]  # of one search alone
        findings += (one.finding for one in exits)
        if not exits and not self.stopped:
            findings.append(Finding.of(Code.NO_EXIT_FOUND, self.problem.source))
        return Analysis(
            tuple(one.energy for one in exits),
            xarray.Dataset() if solution is None else solution.dataset(),
            tuple(finding for number, finding in enumerate(findings) if finding not in findings[:number]),
            branches,
            complete=not self.stopped,
        )

    # --- propose and solve

    def _take(self, source: Source) -> None:
        """Polish what a source proposes."""
        found = self._asked(source, functools.partial(source.propose, self.problem, self._polished[0]))
        self._findings += source.findings
        if source.attains:
            self._least = detailed_balance.with_paths(self.problem, self._least, found)
        waiting = self._polishings is not None and source.effort > Effort.SHOOT  # candidates of sources before
        if found or waiting:
            self._polish(found, source.effort)

    def _asked(self, source: Source, propose: Callable[[], Iterable[Candidate]]) -> Sequence[Candidate]:
        """Return the candidates of a source up to its first error. The error is a finding.

        It is raised if no other source searches and nothing is known.
        """
        found = list[Candidate]()
        try:
            for candidate in propose():
                check_proposal(candidate, self.problem)
                found.append(candidate)
        except OutOfTime:
            raise
        except Exception as error:  # a source may be anybody's
            told = error if isinstance(error, VibrokitError) else StructureError(f"{type(error).__name__}: {error}")
            alone = source.searches and not any(other.searches for other in self.sources if other is not source)
            if alone and not found and self.solution is None and not self._polished[0]:
                raise told from error
            self._failed(source.name, str(told))
        else:
            if not found and source.expected:
                self._findings.append(Finding.of(Code.NOTHING_PROPOSED, self.problem.source, method=source.name))
        return found

    def _polish(self, candidates: Sequence[Candidate], effort: Effort = Effort.FROM_ORBIT) -> None:
        if self._polishings is None:
            self._polishings = self._begun()
        for polishing in self._polishings:
            polishing.add(candidates, effort)
            if self.stopped:
                break

    def _begun(self) -> list[Polishing]:
        """A polishing from each orbit; none where that is impossible, for which a finding has the reason."""
        found = list[Polishing]()
        shared = Shared()
        for orbit in (None,) if self.problem.attractor.repeats else self._orbits_inside():
            try:
                found.append(Polishing(self.problem, orbit, shared))
            except (StructureError, StepperError) as error:
                self._failed("polishing", str(error))
        return found

    def _orbits_inside(self) -> tuple[Orbit, ...]:
        problem, attractor = self.problem, self.problem.attractor
        if attractor.kind != "chaotic":
            self._findings.append(Finding.of(Code.GRAPH_ONLY_SOURCE, problem.source, kind=attractor.kind))
            return ()
        stepper = problem.single_stepper(Flow.STATE_VARIATIONAL)
        with stage("orbits inside the attractor"):
            found = orbits_inside(problem.scene, attractor.points, stepper, self._orbits, 64)
        periods = [orbit.period for orbit in found]
        self._findings.append(Finding.of(Code.CHAOTIC_SOURCE, problem.source, count=len(found), periods=periods))
        return found

    # --- bound

    def _refine(self) -> None:
        """Solve the graph on more nodes until they are of no use for any exit."""
        graph = self._graph
        while graph is not None and graph.costs is not None and not graph.costs.finished and not self.stopped:
            evidence = self._evidence
            settled = evidence.settled(self._accuracy)
            if graph.costs.solved and settled.issuperset(each.target for each in evidence.estimates):
                break
            known = KnownPaths(self._polished[0], settled)
            found = self._asked(graph, functools.partial(graph.finer, known))
            if found:
                self._polish(found)

    def _begin_otherwise(self) -> None:
        """Polish other beginnings of the cheapest path to each attractor, where paths compete that differ little."""
        evidence, solution = self._evidence, self.solution
        if solution is None or not self.problem.attractor.repeats:
            return
        for target in sorted(evidence.cheapest.keys() - evidence.unresolvable):
            with contextlib.suppress(StructureError):  # too close to the attractor for any grid
                self._polish(beginnings(self.problem, solution.potential, evidence.cheapest[target]))

    # --- what is known

    @cached_property
    def _beyond(self) -> frozenset[int]:
        return reached_through_others(self.problem)

    @property
    def solution(self) -> GraphSolution | None:
        """What the graph has found."""
        return None if self._graph is None else self._graph.solution

    @property
    def _search(self) -> Search | None:
        return None if self._shots is None else self._shots.search

    @property
    def _polished(self) -> tuple[tuple[ActivationEnergy, ...], tuple[Finding, ...]]:
        """Branches, the cheapest first, and findings of all orbits."""
        found = [polishing.polished() for polishing in self._polishings or ()]
        branches = sorted((branch for each in found for branch in each.branches), key=lambda branch: branch.value)
        return tuple(branches), tuple(finding for each in found for finding in each.findings)

    @property
    def _evidence(self) -> Evidence:
        return self._weighed(self.solution)

    def _weighed(self, solution: GraphSolution | None) -> Evidence:
        beyond = frozenset[int]() if solution is None else self._beyond
        return Evidence(self.problem.attractor, self._polished[0], solution, tuple(self._least), beyond)

    def _is_over(self, left: Sequence[Source] = ()) -> bool:
        """Whether the work was stopped, or all exits have the proven minimum, with a path if a source left has one."""
        least = {each.target for each in self._least}
        evidence = self._evidence
        proven = evidence.attained if any(source.attains for source in left) else evidence.exact
        return self.stopped or (bool(least) and least <= proven)

    def _unpolished(self, evidence: Evidence) -> tuple[ActivationEnergy, ...]:
        """The action plot's energies of exits without a polished path; their errors take time, which may be over."""
        wanted = {label for end in self.problem.path_ends for label in end.targets}
        wanted |= {estimate.target for estimate in evidence.estimates}
        wanted -= evidence.cheapest.keys()
        wanted -= {each.target for each in self._least if each.bound is Bound.EXACT}
        search = self._search
        kept = () if search is None else tuple(one for one in search.best if one.candidate.target in wanted)
        if search is None or not kept:
            return ()
        shots = dataclasses.replace(search, branches=kept, complete=search.complete and not self.stopped)
        try:
            energies, errors = shots.energies()
        except (StructureError, StepperError) as error:
            self._failed("errors of the action plot", str(error))
            energies, errors = dataclasses.replace(shots, complete=False).energies()
        self._findings += errors.findings
        self._cut |= errors.stopped
        return tuple(energies.values())

    def _failed(self, method: str, reason: str) -> None:
        """Note that a method could not be used."""
        self._findings.append(Finding.of(Code.METHOD_FAILED, self.problem.source, method=method, reason=reason))
