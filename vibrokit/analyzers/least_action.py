"""LeastAction: certified exit paths, from two searches and polishing."""

from __future__ import annotations

import contextlib
import dataclasses
import math
from collections.abc import Sequence, Set
from functools import cached_property
from typing import Any, ClassVar

import xarray

from vibrokit.analyzers.agreement import VAGUE, combined
from vibrokit.analyzers.analyzer import Analysis, Analyzer, at_exit
from vibrokit.analyzers.graph.search import GraphSearch, GraphSolution
from vibrokit.analyzers.path_ends import InBasin
from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.paths.closest_approach import closest_approaches
from vibrokit.analyzers.paths.reversed_relaxation import FINDER, reversed_relaxations
from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.polishing.candidate_polisher import PIECES
from vibrokit.analyzers.polishing.polish import METHOD, Polishing
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.analyzers.shooting.shooting import Shooting
from vibrokit.errors import SceneError, StepperError, StructureError, VibrokitError, shown
from vibrokit.progress import stage
from vibrokit.results.energy import ActivationEnergy, Bound
from vibrokit.results.finding import Code, Finding
from vibrokit.results.least_action import LeastActionResult
from vibrokit.results.result import Result
from vibrokit.structure.boundaries.edges import meeting_cells
from vibrokit.structure.orbits import Orbit
from vibrokit.structure.orbits_inside import orbits_inside
from vibrokit.structure.validation import share, whole
from vibrokit.symbolic.flow_kind import Flow

_MOST_ORBITS = 1000
_LONGEST_ORBIT = 64  # periods of an orbit inside a chaotic attractor
_AGREED = (Code.AGREEMENT, Code.BRACKET, Code.NO_POLISHED_PATH, Code.NOT_SEARCHED)  # more nodes change no other one
_GAIN = 8.0  # by which the error of the graph may fall when its nodes along a side are doubled: third order
_EQUAL = 1e-5  # relative difference of the actions of paths that differ only in where inside a set they start


class LeastAction(Analyzer):
    """Activation energies with a certificate: two searches for exit paths, then Newton's method on each candidate.

    A graph search over the whole section and shooting from the whole fundamental domain of each attractor propose exit
    paths. Each is polished to the extremal path that leaves the attractor and ends on a saddle of its basin boundary,
    or on a face of the region that is left, by multiple shooting on Hamilton's equations and their variational
    equations. The least action is the energy; all others are listed in the result's `branches`. The certificate shows
    how well a path solves its equations. The graph search tests, within its error estimate, whether a cheaper path
    exists, and the lower bound of the energy rests on it.

    Without forcing, the motion from each end back to an equilibrium, run backwards, is the first candidate; where
    detailed balance holds, it is the path of least action. The graph is solved on a quarter of its nodes along each
    side first, and shooting follows. Then it is solved on twice as many, and on all, until it agrees with the paths
    within the `accuracy`. Last, the graph is solved around the beginning of the cheapest path, where paths compete that
    differ by about 0.1 %. Paths are certified after each search. If the work is stopped in between, they are
    returned with the bounds that are known.

    For a chaotic attractor, the graph bounds the energy from below, and paths from unstable orbits inside it bound it
    from above.

    Parameters
    ----------
    shooting : Shooting, optional
        One of the searches; None to do without.
    graph : GraphSearch, optional
        The other one; None to do without.
    accuracy : float
        The graph is refined, up to its `nodes`, until its error is at most this fraction of each energy,
        except of those to attractors that are reached only through other basins, and of those that even its finest
        grid could not resolve.
        The energies themselves are far more accurate; this is how far below them a cheaper path is not excluded.
    orbits : int
        Number of unstable orbits inside a chaotic attractor that paths are polished from.
    source : int or str, optional
        Label or name of the attractor to leave; by default each in turn.
    exit : Exit
        What counts as leaving.
    stepper : Stepper, optional
        By default each search chooses its own, and polishing one that locates contacts.
    """

    result: ClassVar[type[Result]] = LeastActionResult

    shooting: Shooting | None = dataclasses.field(default_factory=Shooting)
    graph: GraphSearch | None = dataclasses.field(default_factory=GraphSearch)
    accuracy: float = 0.1
    orbits: int = 4

    def __post_init__(self) -> None:
        _check_part("shooting", self.shooting, Shooting)
        _check_part("graph", self.graph, GraphSearch)
        if self.shooting is None and self.graph is None:
            raise StructureError("LeastAction: shooting and graph are both None; at least one must search for paths.")
        share("LeastAction: accuracy", self.accuracy)
        whole("LeastAction: orbits", self.orbits, 0, _MOST_ORBITS)

    def analyze(self, problem: ExitProblem) -> Analysis:
        """Find and certify the exit paths of one attractor.

        If the work is stopped, what was found before is returned, marked incomplete.

        Raises
        ------
        SceneError, StructureError, StepperError
            The only search cannot be used for this attractor.
        """
        if problem.at_exit:
            return at_exit(problem, METHOD, Bound.CERTIFIED)
        work = _Work(self, problem)
        steps = (
            (FINDER, work.reverse),
            ("graph", work.search_graph),
            ("action plot", work.shoot),
            ("graph", work.refine_graph),
            ("closest approach", work.approach),
            ("graph", work.search_beginnings),
        )
        for doing, step in steps:
            try:
                step()
            except KeyboardInterrupt as error:
                work.findings.append(Finding.stopped(doing, error, problem.source))
            if work.stopped:
                break
        return work.analysis()


class _Work:
    """What was found so far of the exits of one attractor."""

    def __init__(self, analyzer: LeastAction, problem: ExitProblem) -> None:
        self.analyzer, self.problem = analyzer, problem
        self.graph: GraphSolution | None = None
        self._solutions = iter(()) if analyzer.graph is None else analyzer.graph.solutions(problem, self._settled)
        self._searched = False  # whether there are no more solutions
        self.findings: list[Finding] = []

    @property
    def stopped(self) -> bool:
        return any(finding.code is Code.STOPPED for finding in (*self.findings, *self._polished()[1]))

    def reverse(self) -> None:
        """Run the relaxation to an equilibrium backwards, and polish that."""
        stepper = self.problem.single_stepper(Flow.STATE)
        with stage(FINDER, subject=self.problem.attractor.name):
            found = reversed_relaxations(self.problem, SegmentPropagator(self.problem.scene, stepper, max(PIECES)))
        if found:
            self._polish(found)

    def shoot(self) -> None:
        """Shoot from an orbit or an equilibrium, and polish what is found, if there is an end to polish paths to."""
        if self.analyzer.shooting is None or not self.problem.attractor.is_fixed:
            return
        if self.analyzer.graph is not None and not any(polishing.ends for polishing in self._polishings):
            return
        try:
            found = self.analyzer.shooting.search(self.problem)
        except (StructureError, StepperError) as error:
            self._failed("action plot", error, only=self.analyzer.graph is None)
        else:
            self.findings += found.findings
            self._polish(found.candidates)

    def search_graph(self) -> None:
        """Search the graph on the next number of nodes, the fewest at first, and polish its paths."""
        before = self.graph
        try:
            for found in self._solutions:
                self.graph = found
                if found.last:
                    break
            else:
                self._searched = True
        except (SceneError, StructureError, StepperError) as error:
            self._searched = True
            self._failed("graph search", error, only=self.analyzer.shooting is None and self.graph is None)
        if self.graph is not None and self.graph is not before:
            self._polish(self.graph.candidates)

    def approach(self) -> None:
        """Polish where a chaotic attractor comes nearest to a saddle, for exits that the graph gave no path to."""
        reached = {branch.target for branch in self._polished()[0]}
        with stage("closest approach", subject=self.problem.attractor.name):
            found = [each for each in closest_approaches(self.problem) if each.target not in reached]
        if found:
            self._polish(found)

    def refine_graph(self) -> None:
        """Search the graph again until its error is as small as wanted."""
        while not self._searched and not self.stopped:
            if self.graph is not None and self._graph_error(self.graph) <= self.analyzer.accuracy:
                break
            self.search_graph()

    def search_beginnings(self) -> None:
        """Search other beginnings of the cheapest path to each attractor, and polish those."""
        if self.graph is None or self.analyzer.graph is None or not self.problem.attractor.is_fixed:
            return
        least: dict[int, ActivationEnergy] = {}
        branches = self._polished()[0]  # the cheapest first
        for branch in branches:
            least.setdefault(branch.target, branch)
        for target in sorted(least.keys() - self._unresolvable(self.graph, branches)):
            branch = least[target]
            with contextlib.suppress(StructureError):  # too close to the attractor for any grid
                self._polish(self.analyzer.graph.beginnings(self.problem, branch, self.graph))

    @cached_property
    def _beyond(self) -> frozenset[int]:
        """Labels of the attractors that no saddle leads to, and whose basins do not touch the own one.

        Paths to these pass other basins. They are no first exits, and one estimate of them is enough.
        """
        unled = {label for end in self.problem.path_ends if isinstance(end, InBasin) for label in end.targets}
        if not unled:
            return frozenset()
        touching = {
            label
            for pair in meeting_cells(self.problem.structure.basins)
            if self.problem.source in pair
            for label in pair
        }
        return frozenset(unled - touching)

    def _settled(self) -> Set[int]:
        """Labels of attractors on which an accurate graph and a path agree, or for which finer grids are of no use."""
        branches = self._polished()[0]
        if self.graph is None:
            return set()
        useless = self._beyond | self._unresolvable(self.graph, branches)
        if not self.problem.attractor.is_fixed:
            return useless
        estimates = self._estimates(self.graph, branches)
        _, compared = combined(self.problem.attractor, branches, estimates)
        agreed = {finding.target for finding in compared if finding.code is Code.AGREEMENT}
        accurate = {each.target for each in estimates if each.numerical_error <= self.analyzer.accuracy * each.value}
        return accurate & agreed | useless

    def _unresolvable(self, graph: GraphSolution, branches: Sequence[ActivationEnergy]) -> set[int]:
        """Labels of the attractors to which a path costs so little that even the finest graph would be too coarse."""
        least = {branch.target: branch.value for branch in reversed(branches)}
        within_reach = {
            each.target: each.numerical_error / _GAIN**graph.finer for each in self._estimates(graph, branches)
        }
        return {target for target, error in within_reach.items() if error > VAGUE * least.get(target, math.inf)}

    def _graph_error(self, graph: GraphSolution) -> float:
        """The largest relative error of the graph's estimates of first exits; infinite where paths disagree."""
        branches = self._polished()[0]
        useless = self._beyond | self._unresolvable(graph, branches)
        estimates = [each for each in self._estimates(graph, branches) if each.target not in useless]
        _, compared = combined(self.problem.attractor, branches, estimates)
        if any(finding.code not in _AGREED for finding in compared):
            return math.inf
        return max((each.numerical_error / each.value for each in estimates if each.value), default=0.0)

    def _estimates(self, graph: GraphSolution, branches: Sequence[ActivationEnergy]) -> tuple[ActivationEnergy, ...]:
        """What the graph estimates; paths from or to orbits inside a set do not calibrate it: they give bounds."""
        if not self.problem.attractor.is_fixed:
            return graph.estimates
        return graph.calibrated([branch for branch in branches if branch.bound is not Bound.BRACKET])

    @cached_property
    def _polishings(self) -> list[Polishing]:
        """One for each orbit that paths leave; none where that is impossible, for which a finding has the reason."""
        found = list[Polishing]()
        for orbit in (None,) if self.problem.attractor.is_fixed else self._orbits_inside():
            try:
                found.append(Polishing(self.problem, orbit))
            except (StructureError, StepperError) as error:
                self._failed("polishing", error)
        return found

    def _polish(self, candidates: Sequence[Candidate]) -> None:
        for polishing in self._polishings:
            polishing.add(candidates)
            if self.stopped:
                break

    def _polished(self) -> tuple[tuple[ActivationEnergy, ...], tuple[Finding, ...]]:
        """Branches and findings of all orbits."""
        if "_polishings" not in vars(self):
            return (), ()
        found = [polishing.polished() for polishing in self._polishings]
        branches = tuple(branch for each in found for branch in each.branches)
        findings = tuple(finding for each in found for finding in each.findings)
        return branches if self.problem.attractor.is_fixed else _once(branches), findings

    def analysis(self) -> Analysis:
        """Combine what was found."""
        branches, polished = self._polished()
        estimates = () if self.graph is None else self._estimates(self.graph, branches)
        energies, compared = combined(self.problem.attractor, branches, estimates)
        every = (*self.findings, *(() if self.graph is None else self.graph.findings), *polished)
        findings = [finding for finding in every if finding.code is not Code.NO_EXIT_FOUND]  # of one search alone
        findings += compared
        if not energies and not self.stopped:
            findings.append(Finding.of(Code.NO_EXIT_FOUND, self.problem.source))
        return Analysis(
            energies,
            xarray.Dataset() if self.graph is None else self.graph.dataset(),
            tuple(finding for number, finding in enumerate(findings) if finding not in findings[:number]),
            branches,
            complete=not self.stopped,
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


def _once(branches: Sequence[ActivationEnergy]) -> tuple[ActivationEnergy, ...]:
    """The branches, the cheapest first; of those that differ only in the orbit that they start on, the cheapest."""
    kept: list[ActivationEnergy] = []
    for branch in sorted(branches, key=lambda branch: branch.value):
        if not any(
            (branch.target, branch.saddle) == (other.target, other.saddle)
            and branch.value <= (1 + _EQUAL) * other.value
            for other in kept
        ):
            kept.append(branch)
    return tuple(kept)


def _check_part(name: str, value: Any, kind: type) -> None:
    if value is not None and (not isinstance(value, kind) or isinstance(value, Analyzer)):
        raise StructureError(
            f"LeastAction: {name} must be a {kind.__name__}, such as {kind.__name__}(), or None to do without, got "
            f"{shown(value)}."
        )
