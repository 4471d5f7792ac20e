"""GraphSearch: settings of the graph, and how many nodes and steps it takes in the memory that it may take."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Sequence

import numpy as np

from vibrokit.analyzers.graph.grids import Shape
from vibrokit.analyzers.graph.hierarchy import HierarchySearch
from vibrokit.analyzers.graph.path_ends import exit_targets
from vibrokit.analyzers.graph.solution import ExitCosts, GraphSolution
from vibrokit.analyzers.graph.step_model import StepModel
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.arguments import pair, whole
from vibrokit.construction import Constructed
from vibrokit.errors import SceneError, StructureError, counted
from vibrokit.oscillator import Oscillator
from vibrokit.progress import stage
from vibrokit.results.codes import Code
from vibrokit.results.finding import Finding
from vibrokit.structure.scales import doublings_of
from vibrokit.structure.validation import gibibytes
from vibrokit.symbolic.flow_kind import Flow

_BYTES_KEPT = 116  # for each node of each phase: V, its ceiling, b, R, predecessor, uphill start, flags
_BYTES_PASSING = 700  # for each node of one phase, while its steps are integrated
_ALL_GRIDS = 1.9  # memory of all grids together, in units of the finest
_FEWEST_NODES = 32
_PARTS, _FEWEST_REFINED = (4, 2), 60  # of the nodes along a side: those of grids that come first, and their least
_MOST_STEPS = 1024
_STEPS_PER_PERIOD = (8, 16, 32, 64)  # more in a period that is longer than two of 2π/ω_n


@dataclasses.dataclass(frozen=True, kw_only=True)
class GraphSearch(metaclass=Constructed):
    """Search for the least action from an attractor to its exits, as a shortest path over time and space.

    The period is divided into steps, and the section at each of these phases into nodes. A step from a state x to a
    node y costs ½ eᵀ C⁻¹ e, where e is the vector from the noise-free image of x to y, and C is the covariance
    that noise adds along the step. The least sum of such costs from the attractor is the quasi-potential V. Value
    iteration finds it as a shortest path over the phases. In it x may be any state, with V interpolated between nodes:
    if x were a node too, and damping is weak, grid rounding would add more action than the path itself. Near the
    attractor V is the exact quadratic form.

    The upper bound of an exit is the action of the graph's path, joined to the attractor and relaxed by Hamilton's
    equations: a path of least action costs no more. The error estimate of V is the change when the number of nodes
    along each side is halved, and twice the difference from that action. The latter measures what linearization over a
    step changes, which can be large over a whole period and is about 0.2 % over an eighth of it, and the action that
    interpolation loses where a turn hardly changes the energy. An exit without such a path has no bounds.

    Parameters
    ----------
    nodes : (int, int)
        Nodes in x and in v. `LeastAction` doubles them once more around paths that cost so little that these are too
        coarse.
    steps_per_period : int, optional
        Steps of time in a section interval; even. By default 8, doubled (up to 64) until linearization over a step
        changes no cost by more than 1 %; all these numbers are larger where the interval is longer than 4π/ω_n.
    max_memory_gib : float
        Memory that the search may take (GiB). Where it does not suffice for `nodes` with the least number of steps,
        fewer nodes are taken: a finding tells how many. Longer steps would cost more accuracy.

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

    def check_noise(self, osc: Oscillator) -> None:
        """Raise SceneError if the noise has states of its own."""
        if osc.noise is not None and osc.noise.extra_states:
            raise SceneError(
                f"the noise has {counted(len(osc.noise.extra_states), 'state')} of its own, and the graph covers x and "
                "v only; paths of such a scene are found by shooting alone."
            )

    def search(self, problem: ExitProblem) -> GraphSolution:
        """Search the exits of one attractor, with bounds.

        Raises
        ------
        SceneError
            The noise has its own states.
        StructureError
            No exit was reached, the attractor is not hyperbolic or lies outside the structure's region, the exit has a
            path end that the graph does not know, or the grids would take too much memory.
        """
        costs = self.begin(problem)
        while not costs.finished:
            costs.refine()
        return costs.solution().bounded(problem)

    def begin(self, problem: ExitProblem, *, closer: bool = False) -> ExitCosts:
        """Return a search that has solved nothing yet; `closer` allows twice the nodes, around known paths, at its end.

        The number of nodes along each side doubles from a quarter of `nodes` to all. Errors as of `search`.
        """
        attractor = problem.attractor
        self.check_noise(problem.osc)
        low, high = problem.structure.basins.region.bounds.T
        if np.any((attractor.points[:, :2] < low) | (attractor.points[:, :2] > high)):
            raise StructureError(
                f"{attractor.name} lies outside the region of the structure, which is all that the graph covers; find "
                "the structure on a wider region."
            )
        with stage("exit targets", subject=attractor.name):
            steps = self._affordable(problem.scene)
            model = StepModel(problem.scene, problem.ensemble_stepper(Flow.LINEARISED))
            targets = exit_targets(problem, model)
        shapes = tuple(nodes for nodes in steps if closer or nodes[0] <= self.nodes[0])
        for_all = sum(nodes[0] <= self.nodes[0] for nodes in shapes)
        search = HierarchySearch(problem, model, steps)
        return ExitCosts(search, targets, shapes, for_all, self._findings(problem, shapes))

    def _affordable(self, scene: Oscillator) -> dict[Shape, tuple[int, ...]]:
        """Numbers of nodes, each twice the one before, with the numbers of steps to try that there is memory for.

        Fewer nodes are taken before fewer steps. The last one has twice the `nodes`.
        """
        doublings, (nx, nv) = doublings_of(scene), self.nodes
        wanted = [2**doublings * steps for steps in _STEPS_PER_PERIOD]
        fewer = [2**times * _STEPS_PER_PERIOD[0] for times in reversed(range(doublings))]
        if self.steps_per_period is not None:
            wanted, fewer = [self.steps_per_period], []
        shapes = [(nx // part, nv // part) for part in _PARTS if min(nx, nv) // part >= _FEWEST_REFINED] + [self.nodes]
        found = {nodes: self._within(scene, nodes, wanted) for nodes in shapes}
        finest = max((nodes for nodes, steps in found.items() if steps), default=None)
        if finest is not None:
            most = found[finest]
            closer = self._within(scene, (2 * nx, 2 * nv), most)
            return {nodes: most for nodes in shapes if nodes <= finest} | ({(2 * nx, 2 * nv): closer} if closer else {})
        allowed = self._within(scene, shapes[0], fewer)
        if allowed:
            return {shapes[0]: allowed[:1]}
        needs = self._memory(scene, self.nodes, wanted[0])
        raise StructureError(
            f"a graph of {nx} × {nv} nodes at {wanted[0]} phases needs {needs:.3g} GiB of memory, and max_memory_gib "
            f"is {self.max_memory_gib:.3g}; lower nodes or raise max_memory_gib."
        )

    def _within(self, scene: Oscillator, nodes: Shape, steps: Iterable[int]) -> tuple[int, ...]:
        """Numbers of steps that there is memory for on so many nodes."""
        return tuple(count for count in steps if self._memory(scene, nodes, count) <= self.max_memory_gib)

    def _memory(self, scene: Oscillator, nodes: Shape, steps: int) -> float:
        """Memory that a graph takes (GiB)."""
        phases = 1 if scene.autonomous else steps
        return _ALL_GRIDS * nodes[0] * nodes[1] * (phases * _BYTES_KEPT + _BYTES_PASSING) / 2**30

    def _findings(self, problem: ExitProblem, shapes: Sequence[Shape]) -> tuple[Finding, ...]:
        """What memory left out."""
        if shapes[-1] >= self.nodes:
            return ()
        (nx, nv), (fewer_x, fewer_v) = self.nodes, shapes[-1]
        return (
            Finding.of(
                Code.GRAPH_MEMORY, problem.source, nodes_x=fewer_x, nodes_v=fewer_v, wanted_x=nx, wanted_v=nv,
                memory=self.max_memory_gib,
            ),
        )  # fmt: skip
