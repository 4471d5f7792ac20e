"""GraphSolution: what the graph finds about the exits of one attractor."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping

import numpy as np
import xarray

from vibrokit.analyzers.graph.hierarchy import HierarchySearch, TargetEstimate
from vibrokit.analyzers.graph.potential import Potential
from vibrokit.analyzers.graph.targets import ExitTarget
from vibrokit.analyzers.graph.tracing import METHOD
from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.errors import StructureError
from vibrokit.results.energy import ActivationEnergy, Bound
from vibrokit.results.finding import Code, Finding

_FAR_LESS = 0.25  # of the costliest exit: below, an exit gets a grid that reaches no farther than it needs
_CLOSER = 3  # of these grids, at most, one after the other


@dataclasses.dataclass(frozen=True, eq=False)
class GraphSolution:
    """Least actions of the exits of an attractor, on a grid."""

    source: int  # label of the attractor
    energies: tuple[ActivationEnergy, ...]  # of each place where paths may end, the cheapest first
    candidates: tuple[Candidate, ...]  # distinct paths to these places, in the same order, that end beyond the exit
    potential: Potential  # on the grid that reaches farthest
    findings: tuple[Finding, ...]

    @property
    def estimates(self) -> tuple[ActivationEnergy, ...]:
        """The best energy of each target."""
        best: dict[int, ActivationEnergy] = {}
        for energy in self.energies:
            best.setdefault(energy.target, energy)
        return tuple(best.values())

    def dataset(self) -> xarray.Dataset:
        """Return the potential on the section, and the cheapest path.

        The variables are those of `vibrokit.results.action_graph.ActionGraphResult`, without ``source``.
        """
        values, nodes = self.potential.values[0], self.potential.grids.nodes(0)
        known = np.where(values < self.potential.ceiling, values, np.nan)
        paths = [np.column_stack([path.times, path.states]) for path in self.candidates]
        t, x, v = (paths[0] if paths else np.full((1, 3), np.nan)).T
        return xarray.Dataset(
            {
                "quasi_potential": _array(("node_x", "node_v"), known, "m2 s-3", "quasi-potential on the section"),
                "graph_path_t": _array("graph_step", t, "s", "time along the graph's cheapest path"),
                "graph_path_x": _array("graph_step", x, "m", "position along the graph's cheapest path"),
                "graph_path_v": _array("graph_step", v, "m s-1", "velocity along the graph's cheapest path"),
            },
            coords={
                "quasi_potential_x": _array("node_x", nodes[:, 0, 0], "m", "position of the nodes"),
                "quasi_potential_v": _array("node_v", nodes[0, :, 1], "m s-1", "velocity of the nodes"),
            },
        )


def _array(dims: str | tuple[str, ...], values: object, units: str, long_name: str) -> xarray.Variable:
    return xarray.Variable(dims, values, {"units": units, "long_name": long_name})


def solutions(problem: ExitProblem, search: HierarchySearch, targets: list[ExitTarget]) -> Iterator[GraphSolution]:
    """Yield solutions, each better than the one before.

    A grid that holds the costliest exit has few nodes for one that costs far less. So those that do are solved again
    without the others.

    Raises
    ------
    StructureError
        No exit was reached, or the attractor is not hyperbolic.
    """
    known, potential = search.estimates(targets)
    yield _solution(problem, search, known, potential)
    for _ in range(_CLOSER):
        highest = max((known[target].value for target in targets if np.isfinite(known[target].value)), default=0.0)
        targets = [target for target in targets if 0 < known[target].value < _FAR_LESS * highest]
        if not targets:
            return
        try:
            closer, _ = search.estimates(targets)
        except StructureError:  # too close to the attractor for any grid
            return
        targets = [target for target in targets if closer[target].error < known[target].error]
        known |= {target: closer[target] for target in targets}
        yield _solution(problem, search, known, potential)


def _solution(
    problem: ExitProblem, search: HierarchySearch, known: Mapping[ExitTarget, TargetEstimate], potential: Potential
) -> GraphSolution:
    """What is known of the targets, put together."""
    reached = [
        (target, estimate)
        for target, estimate in sorted(known.items(), key=lambda entry: entry[1].value)
        if np.isfinite(estimate.value)
    ]
    nx, nv = search.shape
    steps = round(problem.scene.section_interval / potential.grids.step)
    used = Finding.of(
        Code.GRAPH, problem.source, nodes_x=nx, nodes_v=nv, steps=steps, stepper=repr(search.model.stepper)
    )  # fmt: skip
    lost = [
        Finding.of(Code.GRAPH_PATH_LOST, problem.source, target.label)
        for target, estimate in reached
        if not estimate.candidates
    ]
    return GraphSolution(
        problem.source,
        tuple(
            ActivationEnergy(
                source=problem.source,
                target=target.label,
                value=estimate.value,
                lower=max(0.0, estimate.value - estimate.error),
                upper=estimate.value + estimate.error,
                method=METHOD,
                bound=Bound.ESTIMATE,
                numerical_error=estimate.error,
                saddle=target.saddle,
            )
            for target, estimate in reached
        ),
        tuple(candidate for _, estimate in reached for candidate in estimate.candidates),
        potential,
        (used, *lost),
    )
