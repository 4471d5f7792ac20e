"""Sources: what proposes exit paths of one attractor. Another one is a class with `propose`, in the list of a road."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from typing import Any, ClassVar

import numpy as np

from vibrokit.analyzers.graph.known_paths import KnownPaths
from vibrokit.analyzers.graph.search import GraphSearch
from vibrokit.analyzers.graph.solution import ExitCosts, GraphSolution
from vibrokit.analyzers.paths import closest_approach, detailed_balance, reversed_relaxation, slow_relaxation
from vibrokit.analyzers.paths.candidate import Candidate, same_action
from vibrokit.analyzers.paths.mirror import FINDER as MIRROR
from vibrokit.analyzers.paths.mirror import Mirror
from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.paths.without_memory import FINDER as WITHOUT_MEMORY
from vibrokit.analyzers.paths.without_memory import WithoutMemory
from vibrokit.analyzers.polishing.ends import pieces_of
from vibrokit.analyzers.polishing.path_solver import Effort
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.analyzers.shooting.search import Search
from vibrokit.analyzers.shooting.shooting import Shooting
from vibrokit.errors import StructureError, shown
from vibrokit.progress import TRAJECTORIES, stage
from vibrokit.results.basins import ESCAPED
from vibrokit.results.energy import ActivationEnergy, Bound
from vibrokit.results.finding import Finding
from vibrokit.symbolic.flow_kind import Flow


class Source(ABC):
    """Proposes exit paths. Abstract.

    Attributes
    ----------
    name : str
        Of the work, in findings: "the straight lines could not be used …"; by default the name of the class.
    searches : bool
        Whether it looks everywhere. The error of the only source that does is an error of the road.
    expected : bool
        Whether it is a finding that it proposes nothing.
    attains : bool
        Whether its paths attain the proven minimum where detailed balance holds.
    effort : Effort
        The most effort of polishing, for its candidates and for all that led to no path so far.
    findings : tuple of Finding
        What else it has to say.
    """

    name: ClassVar[str]
    searches: ClassVar[bool] = False
    expected: ClassVar[bool] = True
    attains: ClassVar[bool] = False
    effort: Effort = Effort.SHOOT
    findings: tuple[Finding, ...] = ()

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        cls.name = getattr(cls, "name", cls.__name__)

    @abstractmethod
    def propose(self, problem: ExitProblem, polished: Sequence[ActivationEnergy]) -> Iterable[Candidate]:
        """Return guesses of exit paths; `polished` are the paths that are known, the cheapest first.

        An error is a finding. The candidates before it are used.
        """


def check_proposal(candidate: Candidate, problem: ExitProblem) -> None:
    """Check that a candidate is a guess of an exit path of this attractor.

    Raises
    ------
    StructureError
    """
    if not isinstance(candidate, Candidate):
        raise StructureError(f"a source must propose Candidate objects, got {shown(candidate)}.")
    count, size, labels = len(candidate.times), problem.attractor.points.shape[1], len(problem.structure.attractors)
    momenta = candidate.states if candidate.momenta is None else candidate.momenta
    if candidate.source != problem.source:
        raise StructureError(f"a candidate leaves {shown(candidate.source)}; it must leave {problem.source}.")
    if candidate.target not in range(ESCAPED, labels):
        raise StructureError(
            f"a candidate leads to {shown(candidate.target)}; it must lead to an attractor, 0 to {labels - 1}, or to "
            f"another exit, -1, or to escape, {ESCAPED}."
        )
    if count < 2 or candidate.states.shape != (count, size) or momenta.shape != (count, size):
        raise StructureError(
            f"a candidate has {count} times, states of shape {candidate.states.shape} and momenta, if given, of "
            f"shape {momenta.shape}; all must be of at least two times, of {size} numbers each."
        )
    steps = np.diff(candidate.times)
    if not np.all(steps > 0) or not np.allclose(steps, steps[0], rtol=1e-3):
        raise StructureError(
            f"a candidate has steps of {steps.min():g} to {steps.max():g} s; they must be positive and equal."
        )
    if not np.isfinite(candidate.states).all() or not np.ptp(candidate.states, axis=0).any():
        raise StructureError(
            f"a candidate goes from {shown(candidate.states[0])} to {shown(candidate.states[-1])}; it must lead by "
            "finite states from the attractor to the exit."
        )
    if not candidate.action >= 0:
        raise StructureError(f"a candidate has the action {shown(candidate.action)}; it must be 0 or positive.")


class MirrorImages(Source):
    """The mirror images of paths, in a scene whose forces are odd: by default those of the attractor's own."""

    name = MIRROR
    expected = False

    def __init__(self, known: Sequence[ActivationEnergy] | None = None) -> None:
        self._known = known

    def propose(self, problem: ExitProblem, polished: Sequence[ActivationEnergy]) -> Sequence[Candidate]:
        """Return those of other actions than the polished paths to the same targets."""
        found = Mirror(problem).candidates(polished if self._known is None else self._known)
        return [
            one
            for one in found
            if not any(each.target == one.target and same_action(one.action, each.value) for each in polished)
        ]


class Relaxations(Source):
    """Relaxations run backwards, to an equilibrium or under slow forcing."""

    name = reversed_relaxation.FINDER
    expected = False
    attains = True

    def propose(self, problem: ExitProblem, polished: Sequence[ActivationEnergy]) -> Sequence[Candidate]:
        """Return those to an equilibrium, exact where detailed balance holds, or those under slow forcing."""
        with stage(self.name, subject=problem.attractor.name, unit=TRAJECTORIES):
            stepper = problem.single_stepper(Flow.STATE)
            propagator = SegmentPropagator(problem.scene, stepper, max(pieces_of(problem.scene)))
            found = reversed_relaxation.reversed_relaxations(problem, propagator)
            slow = slow_relaxation.slow_relaxations(problem, propagator)
        if found:
            least = detailed_balance.least_actions(problem)
            exact = bool(least) and all(each.bound is Bound.EXACT for each in least)
            self.effort = Effort.SHOOT if exact else Effort.FROM_ORBIT
        return [*found, *slow]


class RelaxationsWithoutMemory(Source):
    """Where the noise has extra states: the relaxations run backwards of the same scene under white noise.

    Shooting misses the paths of a noise that is much faster than the mass: almost all extremals follow the noise.
    """

    name = WITHOUT_MEMORY
    expected = False
    effort = Effort.FROM_ORBIT

    def propose(self, problem: ExitProblem, polished: Sequence[ActivationEnergy]) -> Iterable[Candidate]:
        """Return those to an equilibrium, for polishing from their states."""
        white = WithoutMemory(problem)
        if white.filter is None:
            return ()
        with stage(self.name, subject=problem.attractor.name, unit=TRAJECTORIES):
            return tuple(white.candidates(max(pieces_of(problem.scene))))


class Graph(Source):
    """The graph, on the fewest nodes first. It bounds the energies as well.

    Attributes
    ----------
    costs : ExitCosts or None
        What it has found so far; None before it was asked.
    """

    name = "graph"
    expected = False
    searches = True

    def __init__(self, settings: GraphSearch, *, shots_follow: bool) -> None:
        self._settings = settings
        self.effort = Effort.SHOOT if shots_follow else Effort.FROM_ORBIT
        self.costs: ExitCosts | None = None

    @property
    def solution(self) -> GraphSolution | None:
        """What is known so far; None before anything was solved."""
        return self.costs.solution() if self.costs is not None and self.costs.solved else None

    def propose(self, problem: ExitProblem, polished: Sequence[ActivationEnergy]) -> Sequence[Candidate]:
        """Return paths on the fewest nodes on which an exit is reached."""
        self.costs = self._settings.begin(problem, closer=True)
        while not (self.costs.solved or self.costs.finished):
            found = self.finer(KnownPaths(polished))
        return found

    def finer(self, known: KnownPaths) -> Sequence[Candidate]:
        """Return paths on the next number of nodes; `known` is what was found since the last.

        Raises
        ------
        StructureError
            No exit was reached so far on any number of nodes.
        """
        assert self.costs is not None
        before = self.costs.solved
        self.costs.refine(known)
        return self.costs.solution().candidates if self.costs.solved > before else ()


class Shots(Source):
    """Shooting.

    Attributes
    ----------
    search : Search or None
        What was found.
    """

    name = "action plot"
    expected = False
    searches = True
    effort = Effort.FROM_ORBIT

    def __init__(self, settings: Shooting) -> None:
        self._settings = settings
        self.search: Search | None = None

    def propose(self, problem: ExitProblem, polished: Sequence[ActivationEnergy]) -> Sequence[Candidate]:
        """Shoot from an orbit or an equilibrium; from other motion there is nothing to shoot from."""
        if not problem.attractor.is_fixed:
            return ()
        self.search = self._settings.search(problem)
        self.findings = self.search.findings
        self.effort = Effort.FROM_ORBIT if self.search.complete else Effort.SHOOT
        return self.search.candidates


class ClosestApproach(Source):
    """Where a chaotic attractor comes nearest to a saddle, for exits that the graph gives no path to."""

    name = closest_approach.FINDER
    expected = False
    effort = Effort.FROM_ORBIT

    def __init__(self, graph: Graph | None) -> None:
        self._graph = graph

    def propose(self, problem: ExitProblem, polished: Sequence[ActivationEnergy]) -> Sequence[Candidate]:
        """Return one for each saddle at most."""
        solution = None if self._graph is None else self._graph.solution
        reached = set() if solution is None else {candidate.target for candidate in solution.candidates}
        with stage(self.name, subject=problem.attractor.name):
            return [each for each in closest_approach.closest_approaches(problem) if each.target not in reached]
