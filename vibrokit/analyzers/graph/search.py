"""GraphSearch: settings of the graph, and the search itself, on few nodes first."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

import numpy as np

from vibrokit.analyzers.graph.beginnings import beginnings
from vibrokit.analyzers.graph.grids import Shape
from vibrokit.analyzers.graph.hierarchy import TargetEstimate
from vibrokit.analyzers.graph.hierarchy_search import HierarchySearch
from vibrokit.analyzers.graph.known_paths import KnownPaths
from vibrokit.analyzers.graph.path_ends import exit_targets
from vibrokit.analyzers.graph.potential import Potential
from vibrokit.analyzers.graph.solution import GraphSolution
from vibrokit.analyzers.graph.step_model import StepModel
from vibrokit.analyzers.graph.targets import ExitTarget
from vibrokit.analyzers.graph.tracing import METHOD
from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.errors import SceneError, StructureError
from vibrokit.oscillator import Oscillator
from vibrokit.progress import stage
from vibrokit.results.codes import Code
from vibrokit.results.energy import ActivationEnergy, Bound
from vibrokit.results.finding import Finding
from vibrokit.structure.scales import doublings_of
from vibrokit.structure.validation import gibibytes, pair, whole
from vibrokit.symbolic.flow_kind import Flow

_FAR_LESS = 0.25  # of the costliest exit: below, an exit gets a grid that reaches no farther than it needs
_CLOSER = 3  # of these grids, at most, one after the other
_BYTES_KEPT = 116  # for each node of each phase: V, its ceiling, b, R, predecessor, uphill start, flags
_BYTES_PASSING = 700  # for each node of one phase, while its steps are integrated
_ALL_GRIDS = 1.9  # memory of all grids together, in units of the finest
_FEWEST_NODES = 32
_PARTS, _FEWEST_REFINED = (4, 2), 60  # of the nodes along a side: those of grids that come first, and their least
_MOST_STEPS = 1024
_STEPS_PER_PERIOD = (8, 16, 32, 64)  # more in a period that is longer than two of 2π/ω_n


@dataclasses.dataclass(frozen=True, kw_only=True)
class GraphSearch:
    """Search for the least action from an attractor to its exits, as a shortest path over time and space.

    The period is divided into steps, and the section at each of these phases into nodes. A step from a state x to a
    node y costs ½ eᵀ C⁻¹ e, where e is the vector from the noise-free image of x to y, and C is the covariance
    that noise adds along the step. The least sum of such costs from the attractor is the quasi-potential V. Value
    iteration finds it as a shortest path over the phases. In it x may be any state, with V interpolated between nodes:
    if x were a node too, and damping is weak, grid rounding would add more action than the path itself. Near the
    attractor V is the exact quadratic form.

    The error estimate of an exit is the change when the number of nodes along each side is halved, and the difference
    from the action of the graph's path after relaxation by Hamilton's equations. The latter measures what
    linearization over a step changes: it can be large over a whole period, and is about 0.2 % over an eighth of it.

    Parameters
    ----------
    nodes : (int, int)
        Nodes in x and in v.
    steps_per_period : int, optional
        Steps of time in a section interval; even. By default 8, doubled (up to 64) until linearization over a step
        changes no cost by more than 1 %; all these numbers are larger where the interval is longer than 4π/ω_n.
    max_memory_gib : float
        Memory that the search may take (GiB).

    Raises
    ------
    StructureError
        A setting has a value that is not allowed.
    """

    nodes: tuple[int, int] = (360, 360)
    steps_per_period: int | None = None
    max_memory_gib: float = 4.0

    def __post_init__(self) -> None:
        name, steps = type(self).__name__, self.steps_per_period
        object.__setattr__(self, "nodes", pair(f"{name}: nodes", self.nodes, least=_FEWEST_NODES))
        if steps is not None:
            whole(f"{name}: steps_per_period", steps, 2, _MOST_STEPS)
            if steps % 2:
                raise StructureError(
                    f"{name}: steps_per_period must be an even number, got {steps}; the error is estimated with steps "
                    "twice as long."
                )
        gibibytes(f"{name}: max_memory_gib", self.max_memory_gib)

    def search(self, problem: ExitProblem) -> GraphSolution:
        """Search the exits of one attractor.

        Raises
        ------
        SceneError
            The noise has its own states.
        StructureError
            No exit was reached, the attractor is not hyperbolic or lies outside the structure's region, the exit has a
            path end that the graph does not know, or the grids would take too much memory.
        """
        *_, best = self.solutions(problem)
        return best

    def solutions(self, problem: ExitProblem, known: Callable[[], KnownPaths] = KnownPaths) -> Iterator[GraphSolution]:
        """Yield solutions, each better than the one before; `search` returns the last. Errors as of `search`.

        The number of nodes along each side doubles from a quarter of `nodes` to all. A grid that holds the costliest
        exit has few nodes for one that costs far less. So those that do are solved again without the others. `known` is
        called before each number of nodes.
        """
        noise, attractor = problem.osc.noise, problem.attractor
        if noise is not None and noise.extra_states:
            raise SceneError(
                f"the noise has {len(noise.extra_states)} states of its own, and the graph covers x and v only; use "
                "ActionPlot."
            )
        low, high = problem.structure.basins.region.bounds.T
        if np.any((attractor.points[:, :2] < low) | (attractor.points[:, :2] > high)):
            raise StructureError(
                f"{attractor.name} lies outside the region of the structure, which is all that the graph covers; find "
                "the structure on a wider region."
            )
        with stage("exit targets", subject=attractor.name):
            search = self._hierarchies(problem)
            targets = exit_targets(problem, search.model)
        found, refinements = _Found(), list(self._refinements())
        for number, nodes in enumerate(refinements, start=1):
            found.finer, paths = len(refinements) - number, known()
            unsettled = [target for target in targets if not paths.settled >= set(target.labels)]
            # Grids for targets that are no farther than the own basin cover that basin alone.
            both = ([target for target in unsettled if target.farther is farther] for farther in (True, False))
            groups = [group for group in both if group]
            for group in groups:
                try:
                    yield from _solutions(problem, search, group, nodes, paths, found, last=group is groups[-1])
                except StructureError:  # on few nodes, no exit may be reached
                    if nodes == self.nodes and not found.estimates:
                        raise

    def beginnings(
        self, problem: ExitProblem, energy: ActivationEnergy, solved: GraphSolution
    ) -> tuple[Candidate, ...]:
        """Return candidates that begin otherwise than a known path, from a closer look at where a solution has it."""
        return beginnings(problem, self._hierarchies(problem), solved.potential, energy)

    def _hierarchies(self, problem: ExitProblem) -> HierarchySearch:
        """What solves hierarchies of up to the nodes that are set."""
        steps = self._affordable_steps(problem.scene)
        model = StepModel(problem.scene, problem.ensemble_stepper(Flow.LINEARISED))
        return HierarchySearch(problem, model, steps, self.nodes)

    def _refinements(self) -> Iterator[Shape]:
        """Numbers of nodes from few to those that are set, each twice the one before."""
        nx, nv = self.nodes
        for part in _PARTS:
            if min(nx, nv) // part >= _FEWEST_REFINED:
                yield nx // part, nv // part
        yield self.nodes

    def _affordable_steps(self, scene: Oscillator) -> tuple[int, ...]:
        """Numbers of steps to try that there is memory for; in a long period, fewer than wanted if need be."""
        doublings = doublings_of(scene)
        wanted = [2**doublings * steps for steps in _STEPS_PER_PERIOD]
        fewer = [2**times * _STEPS_PER_PERIOD[0] for times in range(doublings)]
        if self.steps_per_period is not None:
            wanted, fewer = [self.steps_per_period], []
        allowed = [steps for steps in (*fewer, *wanted) if self._memory(scene, steps) <= self.max_memory_gib]
        if not allowed:
            (nx, nv), steps = self.nodes, (*fewer, *wanted)[0]
            raise StructureError(
                f"a graph of {nx} × {nv} nodes at {steps} phases needs {self._memory(scene, steps):.3g} GiB of "
                f"memory, and max_memory_gib is {self.max_memory_gib:.3g}; lower nodes or raise max_memory_gib."
            )
        return tuple(steps for steps in allowed if steps >= wanted[0]) or (allowed[-1],)

    def _memory(self, scene: Oscillator, steps: int) -> float:
        """Memory that a graph takes (GiB)."""
        phases = 1 if scene.autonomous else steps
        return _ALL_GRIDS * self.nodes[0] * self.nodes[1] * (phases * _BYTES_KEPT + _BYTES_PASSING) / 2**30


@dataclasses.dataclass(eq=False)
class _Found:
    """What was found so far."""

    estimates: dict[ExitTarget, TargetEstimate] = dataclasses.field(default_factory=dict)
    potential: Potential | None = None  # on the finest grid that reaches the costliest target
    finer: int = 0  # refinements that follow


def _solutions(
    problem: ExitProblem,
    search: HierarchySearch,
    targets: Sequence[ExitTarget],
    nodes: Shape,
    known: KnownPaths,
    found: _Found,
    *,
    last: bool,
) -> Iterator[GraphSolution]:
    """Solve for all targets together, then for those that cost far less without the others; keep what is known."""
    estimates = found.estimates
    solved, potential = search.estimates(targets, nodes, known)
    estimates |= solved
    if found.potential is None or _highest(targets, estimates) == _highest(estimates, estimates):
        found.potential = potential
    for _ in range(_CLOSER):
        costs = {target: min(estimates[target].value, known.cost(target)) for target in targets}
        highest = max((cost for cost in costs.values() if np.isfinite(cost)), default=0.0)
        targets = [target for target in targets if 0 < costs[target] < _FAR_LESS * highest]
        if not targets:
            break
        yield _solution(problem, search, found, nodes, last=False)
        try:
            closer, _ = search.estimates(targets, nodes, known)
        except StructureError:  # too close to the attractor for any grid
            break
        better = [
            target for target in closer if target not in estimates or closer[target].error < estimates[target].error
        ]
        targets = [target for target in targets if target in better]
        estimates |= {target: closer[target] for target in better}
    yield _solution(problem, search, found, nodes, last=last)


def _highest(targets: Iterable[ExitTarget], estimates: Mapping[ExitTarget, TargetEstimate]) -> float:
    """The cost of the costliest of those targets that are reached; 0 if none is."""
    return max((estimates[target].value for target in targets if np.isfinite(estimates[target].value)), default=0.0)


def _solution(
    problem: ExitProblem,
    search: HierarchySearch,
    found: _Found,
    nodes: Shape,
    *,
    last: bool,
) -> GraphSolution:
    """What is known of the targets, put together."""
    reached = [
        (target, estimate)
        for target, estimate in sorted(found.estimates.items(), key=lambda entry: entry[1].value)
        if np.isfinite(estimate.value)
    ]
    potential, (nx, nv) = found.potential, nodes
    assert potential is not None
    steps = potential.grids.steps
    used = Finding.of(
        Code.GRAPH, problem.source, nodes_x=nx, nodes_v=nv, steps=steps, stepper=repr(search.model.stepper)
    )  # fmt: skip
    lost = [
        Finding.of(Code.GRAPH_PATH_LOST, problem.source, label)
        for target, estimate in reached
        for label in target.labels
        if not estimate.candidates
    ]
    return GraphSolution(
        tuple(
            ActivationEnergy(
                source=problem.source,
                target=label,
                value=estimate.value,
                lower=max(0.0, estimate.value - estimate.error),
                upper=estimate.value + estimate.error,
                method=METHOD,
                bound=Bound.ESTIMATE,
                numerical_error=estimate.error,
                saddle=target.saddle,
            )
            for target, estimate in reached
            for label in target.labels
        ),
        tuple(_labelled(reached)),
        potential,
        (used, *lost),
        {label: estimate.by_nodes for target, estimate in reversed(reached) for label in target.labels},
        {label: estimate.side for target, estimate in reversed(reached) for label in target.labels},
        last,
        found.finer,
    )


def _labelled(reached: Sequence[tuple[ExitTarget, TargetEstimate]]) -> Iterator[Candidate]:
    """The candidates of targets, the cheapest first, each for an attractor that no cheaper target leads to, if any."""
    known = set[int]()
    for target, estimate in reached:
        label = next((label for label in target.labels if label not in known), target.labels[0])
        known |= set(target.labels)
        yield from (dataclasses.replace(candidate, target=label) for candidate in estimate.candidates)
