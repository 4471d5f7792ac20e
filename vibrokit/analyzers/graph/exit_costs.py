"""ExitCosts: what reaching the exit targets of one attractor costs, as far as it is known."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np

from vibrokit.analyzers.graph.around_paths import LOOSE
from vibrokit.analyzers.graph.coverage import FAR_LESS, STEP_TOLERANCE
from vibrokit.analyzers.graph.grids import Shape
from vibrokit.analyzers.graph.hierarchy import TargetEstimate
from vibrokit.analyzers.graph.hierarchy_search import HierarchySearch
from vibrokit.analyzers.graph.known_paths import KnownPaths
from vibrokit.analyzers.graph.potential import Potential
from vibrokit.analyzers.graph.solution import GraphSolution
from vibrokit.analyzers.graph.targets import ExitTarget
from vibrokit.analyzers.graph.tracing import METHOD
from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.errors import StructureError
from vibrokit.results.codes import Code
from vibrokit.results.energy import ActivationEnergy, Bound
from vibrokit.results.finding import Finding

_CLOSER = 3  # grids for exits that cost far less, at most, one after the other


@dataclasses.dataclass(eq=False)
class ExitCosts:
    """What was found so far."""

    search: HierarchySearch
    findings: tuple[Finding, ...]
    estimates: dict[ExitTarget, TargetEstimate] = dataclasses.field(default_factory=dict)
    potential: Potential | None = None  # on the finest grid that reaches the costliest target
    finer: int = 0  # refinements that follow
    last_for_all: bool = False  # whether these are only for exits that the graph is too coarse for

    def refined(self, targets: Sequence[ExitTarget], nodes: Shape, known: KnownPaths) -> Iterator[GraphSolution]:
        """Solve for all targets together, then for those that cost far less without the others; keep what is known.

        Yields what is known in between. Raises StructureError if no target was reached.
        """
        estimates = self.estimates
        solved, potential = self.search.estimates(targets, nodes, known)
        estimates |= {
            target: one for target, one in solved.items() if np.isfinite(one.value) or target not in estimates
        }
        if self.potential is None or _highest(targets, estimates) == _highest(estimates, estimates):
            self.potential = potential
        for _ in range(_CLOSER):
            targets = _apart(targets, estimates, known)
            if not targets:
                break
            yield self.solution(nodes, last=False)
            try:
                closer, _ = self.search.estimates(targets, nodes, known)
            except StructureError:  # too close to the attractor for any grid
                break
            targets = [target for target in targets if closer[target].error < estimates[target].error]
            estimates |= {target: closer[target] for target in targets}

    def solution(self, nodes: Shape, *, last: bool) -> GraphSolution:
        """What is known of the targets, put together."""
        reached = [
            (target, estimate)
            for target, estimate in sorted(self.estimates.items(), key=lambda entry: entry[1].value)
            if np.isfinite(estimate.value)
        ]
        potential, (nx, nv) = self.potential, nodes
        assert potential is not None
        source, steps, stepper = self.search.problem.source, potential.grids.steps, repr(self.search.model.stepper)
        used = Finding.of(Code.GRAPH, source, nodes_x=nx, nodes_v=nv, steps=steps, stepper=stepper)
        cheapest = {label: estimate for target, estimate in reversed(reached) for label in target.labels}
        lost = [
            Finding.of(Code.GRAPH_PATH_LOST, source, label)
            for label, estimate in cheapest.items()
            if not estimate.candidates
        ]
        return GraphSolution(
            tuple(
                ActivationEnergy(
                    source=source,
                    target=label,
                    value=estimate.value,
                    lower=max(0.0, estimate.value - estimate.error),
                    upper=np.inf,
                    method=METHOD,
                    bound=Bound.ESTIMATE,
                    numerical_error=estimate.error,
                    saddle=target.saddle,
                )
                for target, estimate in reached
                for label in target.labels
            ),
            tuple(estimate for target, estimate in reached for _ in target.labels),
            tuple(_labelled(reached)),
            potential,
            (used, *self.findings, *self._not_converged(), *lost),
            cheapest,
            max((max(steps) for shape, steps in self.search.steps_per_period.items() if shape > nodes), default=0),
            last,
            self.finer,
            self.last_for_all,
        )

    def _not_converged(self) -> Iterator[Finding]:
        """What sweeps left open, if that matters."""
        part = max((estimate.unsettled for estimate in self.estimates.values()), default=0.0)
        if part > STEP_TOLERANCE:
            yield Finding.of(Code.GRAPH_NOT_CONVERGED, self.search.problem.source, part=part)


def _apart(
    targets: Sequence[ExitTarget], estimates: Mapping[ExitTarget, TargetEstimate], known: KnownPaths
) -> list[ExitTarget]:
    """Targets that get grids of their own: they cost far less than others, or have known paths and others have none."""
    costs = {target: min(estimates[target].value, known.cost(target)) for target in targets}
    highest = max((cost for cost in costs.values() if np.isfinite(cost)), default=0.0)
    unknown = not known.leads_to_all(targets)
    return [
        target
        for target in targets
        if 0 < costs[target] < FAR_LESS * highest or (unknown and estimates[target].value > LOOSE * known.cost(target))
    ]


def _highest(targets: Iterable[ExitTarget], estimates: Mapping[ExitTarget, TargetEstimate]) -> float:
    """The cost of the costliest of those targets that are reached; 0 if none is."""
    return max((estimates[target].value for target in targets if np.isfinite(estimates[target].value)), default=0.0)


def _labelled(reached: Sequence[tuple[ExitTarget, TargetEstimate]]) -> Iterator[Candidate]:
    """The candidates of targets, the cheapest first, each for an attractor that no cheaper target leads to, if any."""
    known = set[int]()
    for target, estimate in reached:
        label = next((label for label in target.labels if label not in known), target.labels[0])
        known |= set(target.labels)
        yield from (dataclasses.replace(candidate, target=label) for candidate in estimate.candidates)
