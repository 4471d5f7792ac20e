"""ExitSearch: what the searches and the polishing of `LeastAction` have found of the exits of one attractor."""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import xarray

from vibrokit.analyzers.analyzer import Analysis
from vibrokit.analyzers.evidence import Evidence, reached_through_others
from vibrokit.analyzers.graph.known_paths import KnownPaths
from vibrokit.analyzers.graph.solution import GraphSolution
from vibrokit.analyzers.paths import closest_approach, detailed_balance, mirror, reversed_relaxation, slow_relaxation
from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.polishing.ends import pieces_of
from vibrokit.analyzers.polishing.path_solver import Effort
from vibrokit.analyzers.polishing.polish import Polishing, Shared
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.analyzers.shooting.search import Search
from vibrokit.errors import SceneError, StepperError, StructureError, VibrokitError
from vibrokit.progress import TRAJECTORIES, stage
from vibrokit.results.codes import Code
from vibrokit.results.energy import ActivationEnergy, Bound
from vibrokit.results.finding import Finding
from vibrokit.results.stoppable import Stoppable
from vibrokit.structure.orbits import Orbit
from vibrokit.structure.orbits_inside import orbits_inside
from vibrokit.symbolic.flow_kind import Flow

if TYPE_CHECKING:
    from vibrokit.analyzers.least_action import LeastAction

_LONGEST_ORBIT = 64  # periods of an orbit inside a chaotic attractor


class ExitSearch:
    """What was found so far of the exits of one attractor."""

    def __init__(self, analyzer: LeastAction, problem: ExitProblem) -> None:
        self.analyzer, self.problem = analyzer, problem
        self.graph: GraphSolution | None = None
        self._rougher: GraphSolution | None = None  # the last one on half as many nodes along each side
        self._mirror = mirror.Mirror(problem)
        self._least = detailed_balance.least_actions(problem)
        self._solutions = iter(()) if analyzer.graph is None else analyzer.graph.solutions(problem, self._known)
        self._shots_follow = analyzer.shooting is not None and problem.attractor.is_fixed
        self._shots: Search | None = None
        self._searched = self._reversed = False  # whether there are no more solutions, and no more relaxations
        self._cut = False  # whether a step was stopped
        self._polishings: list[Polishing] | None = None  # one for each orbit that paths leave; None before the first
        self.findings: list[Finding] = []

    def run(self) -> Analysis:
        """Search, polish and check, step by step, until the end or until the work is stopped."""
        steps = (
            (mirror.FINDER, self.mirror),
            (reversed_relaxation.FINDER, self.reverse),
            ("graph", self.search_graph),
            ("action plot", self.shoot),
            (mirror.FINDER, self.mirror),
            ("graph", self.refine_graph),
            (closest_approach.FINDER, self.approach),
            ("graph", self.search_beginnings),
        )
        for doing, step in steps:
            with Stoppable(doing, self.problem.source) as work:
                step()
            self.findings += work.findings
            self._cut |= work.stopped
            if self.stopped or self._is_exact:
                break
        return self.analysis()

    @property
    def stopped(self) -> bool:
        """Whether the work was stopped anywhere before its end."""
        parts = (self.graph, self._shots, *(self._polishings or ()))
        return self._cut or not all(part.complete for part in parts if part is not None)

    @property
    def _is_exact(self) -> bool:
        """Whether all exits cost what no path can cost less than, after reversed relaxations were polished."""
        least = {each.target for each in self._least}
        return self._reversed and bool(least) and least <= self._evidence.exact

    def mirror(self) -> None:
        """Polish mirror images of known paths; those that leave another attractor take the place of shooting."""
        images = self._mirror.candidates(self._polished()[0])
        if images:
            self._polish(images, quick=self.analyzer.graph is not None)
            self._shots_follow &= not self._polished()[0]

    def revisit(self, known: tuple[ActivationEnergy, ...]) -> Analysis | None:
        """Polish mirror images of paths that were found later, where they cost less than the own ones."""
        self.problem = dataclasses.replace(self.problem, known=known)
        self._mirror = mirror.Mirror(self.problem)
        images = self._mirror.candidates(self._polished()[0], cheaper=True)
        if not images:
            return None
        self._polish(images, quick=True)
        return self.analysis()

    def reverse(self) -> None:
        """Run relaxations backwards, to an equilibrium or under slow forcing, and polish these."""
        stepper = self.problem.single_stepper(Flow.STATE)
        with stage(reversed_relaxation.FINDER, subject=self.problem.attractor.name, unit=TRAJECTORIES):
            propagator = SegmentPropagator(self.problem.scene, stepper, max(pieces_of(self.problem.scene)))
            found = reversed_relaxation.reversed_relaxations(self.problem, propagator)
            slow = slow_relaxation.slow_relaxations(self.problem, propagator)
        self._least = detailed_balance.with_paths(self.problem, self._least, found)
        if found:
            exact = bool(self._least) and all(each.bound is Bound.EXACT for each in self._least)
            self._polish(found, effort=Effort.JOIN if exact else Effort.FROM_ORBIT)
        if slow:
            self._polish(slow, quick=self._shots_follow)
        self._reversed = True

    def shoot(self) -> None:
        """Shoot from an orbit or an equilibrium, and polish what is found; without an end to polish to, it bounds."""
        shooting, follow, self._shots_follow = self.analyzer.shooting, self._shots_follow, False
        if shooting is None or not follow:
            return
        candidates: Sequence[Candidate] = ()
        complete = True
        try:
            found = self._shots = shooting.search(self.problem)
            candidates, complete = found.candidates, found.complete
            self.findings += found.findings
        except (StructureError, StepperError) as error:
            self._failed("action plot", error, only=self.analyzer.graph is None)
        if candidates or self._polishings is not None:  # candidates of the first graph may wait
            self._polish(candidates, quick=not complete)

    def search_graph(self) -> None:
        """Search the graph on the next number of nodes, the fewest at first, and polish its paths."""
        before = self.graph
        try:
            for found in self._solutions:
                if before is not None and before.finer > found.finer:
                    self._rougher = before
                self.graph = found
                if found.last:
                    break
            else:
                self._searched = True
        except (SceneError, StructureError, StepperError) as error:
            self._searched = True
            self._failed("graph search", error, only=self.analyzer.shooting is None and self.graph is None)
        if self.graph is not None and self.graph is not before:
            self._polish(self.graph.candidates, quick=self._shots_follow)

    def approach(self) -> None:
        """Polish where a chaotic attractor comes nearest to a saddle, for exits that the graph gave no path to."""
        reached = () if self.graph is None else {candidate.target for candidate in self.graph.candidates}
        with stage(closest_approach.FINDER, subject=self.problem.attractor.name):
            found = [each for each in closest_approach.closest_approaches(self.problem) if each.target not in reached]
        if found:
            self._polish(found)

    def refine_graph(self) -> None:
        """Search the graph again until its error is as small as wanted."""
        while not self._searched and not self.stopped:
            if self.graph is not None and self._evidence.graph_error <= self.analyzer.accuracy:
                break
            self.search_graph()

    def search_beginnings(self) -> None:
        """Search other beginnings of the cheapest path to each attractor, and polish those."""
        if self.graph is None or self.analyzer.graph is None or not self.problem.attractor.repeats:
            return
        evidence = self._evidence
        for target in sorted(evidence.cheapest.keys() - evidence.unresolvable - evidence.images.keys()):
            with contextlib.suppress(StructureError):  # too close to the attractor for any grid
                self._polish(self.analyzer.graph.beginnings(self.problem, evidence.cheapest[target], self.graph))

    @cached_property
    def _beyond(self) -> frozenset[int]:
        return reached_through_others(self.problem)

    @property
    def _evidence(self) -> Evidence:
        attractor, branches, images = self.problem.attractor, self._polished()[0], self._mirror.energies
        beyond = frozenset[int]() if self.graph is None else self._beyond
        return Evidence(attractor, branches, self.graph, self._rougher, images, tuple(self._least), beyond)

    def _known(self) -> KnownPaths:
        return KnownPaths(self._polished()[0], self._evidence.settled(self.analyzer.accuracy))

    def _unpolished(self, evidence: Evidence) -> tuple[ActivationEnergy, ...]:
        """The action plot's energies of exits without a polished path; their errors take time, which may be over."""
        wanted = {label for end in self.problem.path_ends for label in end.targets}
        wanted |= {estimate.target for estimate in evidence.estimates}
        wanted -= evidence.cheapest.keys()
        wanted -= {each.target for each in self._least if each.bound is Bound.EXACT}
        shot = () if self._shots is None else self._shots.branches
        kept = tuple(branch for branch in shot if branch.candidate.target in wanted)
        if self._shots is None or not kept:
            return ()
        complete = self._shots.complete and not self.stopped
        shots = dataclasses.replace(self._shots, branches=kept, complete=complete)
        try:
            estimates, errors = shots.rated
        except (StructureError, StepperError) as error:
            self._failed("errors of the action plot", error)
            return dataclasses.replace(shots, complete=False).estimates
        self.findings += errors.findings
        self._cut |= errors.stopped
        return estimates

    def _begun(self) -> list[Polishing]:
        """A polishing from each orbit; none where that is impossible, for which a finding has the reason."""
        found = list[Polishing]()
        shared = Shared()
        for orbit in (None,) if self.problem.attractor.repeats else self._orbits_inside():
            try:
                found.append(Polishing(self.problem, orbit, shared))
            except (StructureError, StepperError) as error:
                self._failed("polishing", error)
        return found

    def _polish(
        self, candidates: Sequence[Candidate], *, quick: bool = False, effort: Effort = Effort.FROM_ORBIT
    ) -> None:
        if self._polishings is None:
            self._polishings = self._begun()
        for polishing in self._polishings:
            polishing.add(candidates, Effort.SHOOT if quick else effort)
            if self.stopped:
                break

    def _polished(self) -> tuple[tuple[ActivationEnergy, ...], tuple[Finding, ...]]:
        """Branches and findings of all orbits."""
        found = [polishing.polished() for polishing in self._polishings or ()]
        branches = sorted((branch for each in found for branch in each.branches), key=lambda branch: branch.value)
        findings = tuple(finding for each in found for finding in each.findings)
        return tuple(branches), findings

    def analysis(self) -> Analysis:
        """Combine what was found."""
        branches, polished = self._polished()
        evidence = self._evidence
        if self.graph is not None:
            self.graph = self.graph.bounded(self.problem, evidence.cheapest.keys())
            evidence = self._evidence
        compared = evidence.compared(self._unpolished(evidence))
        energies = tuple(one.energy for one in compared)
        graph = () if self.graph is None else self.graph.findings
        every = (*self.findings, *graph, *polished)
        findings = [finding for finding in every if finding.code is not Code.NO_EXIT_FOUND]  # of one search alone
        findings += (one.finding for one in compared)
        if not energies and not self.stopped:
            findings.append(Finding.of(Code.NO_EXIT_FOUND, self.problem.source))
        return Analysis(
            energies,
            xarray.Dataset() if self.graph is None else self.graph.dataset(),
            tuple(finding for number, finding in enumerate(findings) if finding not in findings[:number]),
            branches,
            complete=not self.stopped,
            revisit=self.revisit,
        )

    def _failed(self, method: str, error: VibrokitError, *, only: bool = False) -> None:
        """Note that a method could not be used; raise its error again if it is the only search."""
        if only:
            raise error
        reason = str(error)
        self.findings.append(Finding.of(Code.METHOD_FAILED, self.problem.source, method=method, reason=reason))

    def _orbits_inside(self) -> tuple[Orbit, ...]:
        problem, attractor = self.problem, self.problem.attractor
        if attractor.kind != "chaotic":
            self.findings.append(Finding.of(Code.GRAPH_ONLY_SOURCE, problem.source, kind=attractor.kind))
            return ()
        stepper = problem.single_stepper(Flow.STATE_VARIATIONAL)
        with stage("orbits inside the attractor"):
            found = orbits_inside(problem.scene, attractor.points, stepper, self.analyzer.orbits, _LONGEST_ORBIT)
        periods = [orbit.period for orbit in found]
        self.findings.append(
            Finding.of(Code.CHAOTIC_SOURCE, problem.source, count=len(found), periods=periods)
        )  # fmt: skip
        return found
