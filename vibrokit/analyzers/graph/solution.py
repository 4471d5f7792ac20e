"""GraphSolution: the costs of the exits of one attractor, by the graph. ExitCosts: the search that refines them."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence

import numpy as np
import xarray

from vibrokit.analyzers.graph.grids import Shape
from vibrokit.analyzers.graph.hierarchy import HierarchySearch, TargetEstimate
from vibrokit.analyzers.graph.known_paths import KnownPaths
from vibrokit.analyzers.graph.potential import Potential
from vibrokit.analyzers.graph.targets import ExitTarget
from vibrokit.analyzers.graph.tolerances import TOLERANCES
from vibrokit.analyzers.graph.traced_path import whole_action
from vibrokit.analyzers.graph.tracing import METHOD
from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.errors import StructureError
from vibrokit.progress import stage
from vibrokit.results.codes import Code
from vibrokit.results.energy import ActivationEnergy, Bound
from vibrokit.results.finding import Finding
from vibrokit.results.stoppable import Stoppable

WHOLE_PATHS = "whole paths"


@dataclasses.dataclass(frozen=True, eq=False)
class GraphSolution:
    """Least actions of the exits of an attractor, on a grid."""

    energies: tuple[ActivationEnergy, ...]  # of each place where paths may end, the cheapest first
    behind: tuple[TargetEstimate, ...]  # what gave each of them
    candidates: tuple[Candidate, ...]  # distinct paths to these places, in the same order, that end beyond the exit
    potential: Potential  # on the grid that reaches farthest
    findings: tuple[Finding, ...]
    cheapest: Mapping[int, TargetEstimate]  # what gave each target's best energy
    most_steps: int  # steps in a section interval that those on more nodes may have
    finer: int  # how many times the nodes along a side may still be doubled
    last_for_all: bool  # whether finer ones follow only for exits that it is too coarse for
    complete: bool = True  # False if `bounded` was stopped before its end

    def calibrated(self, polished: Sequence[ActivationEnergy]) -> tuple[ActivationEnergy, ...]:
        """Return the estimates, with errors from actions that are known.

        What linearization over a step and interpolation change is estimated from the action of the graph's own path,
        which is relaxed only roughly. The action of a polished path to the same target shows it better: of a cheaper
        one always, of a costlier one where the error is smaller than the graph's own.
        """
        least: dict[int, float] = {}
        for path in polished:
            least[path.target] = min(path.value, least.get(path.target, np.inf))
        found = []
        for one in self.estimates:
            if one.target not in least:
                found.append(one)
                continue
            action = least[one.target]
            error = self.cheapest[one.target].by_nodes + TOLERANCES.by_path * abs(action - one.value)
            found.append(_with_error(one, error if action < one.value else min(error, one.numerical_error)))
        return tuple(found)

    def bounded(self, problem: ExitProblem, polished: Container[int] = ()) -> GraphSolution:
        """Return the same solution with energies that are bounded by the actions of whole paths.

        What V is too low by, where interpolation leaks action, shows only beside such an action. So an energy without a
        whole path has no bounds, and one that is far below it is replaced by it. Exits that polished paths lead to keep
        their energies. If the work is stopped, a finding says so, and the others have no bounds.
        """
        pairs = list(zip(self.energies, self.behind, strict=True))
        actions = {estimate: math.inf for energy, estimate in pairs if energy.target not in polished}
        with Stoppable(WHOLE_PATHS, problem.source) as work, stage(WHOLE_PATHS, subject=problem.attractor.name):
            for estimate in actions:
                found = (whole_action(problem, path) for path in estimate.paths)
                actions[estimate] = next((action for action in found if math.isfinite(action)), math.inf)
        energies = [
            energy if energy.target in polished else _bounded(energy, estimate, actions[estimate])
            for energy, estimate in pairs
        ]
        findings = (*self.findings, *work.findings)
        return dataclasses.replace(self, energies=tuple(energies), findings=findings, complete=not work.stopped)

    @property
    def estimates(self) -> tuple[ActivationEnergy, ...]:
        """The best energy of each target: that with the least upper bound, and the least lower bound of all."""
        found: dict[int, list[ActivationEnergy]] = {}
        for energy in self.energies:
            found.setdefault(energy.target, []).append(energy)
        return tuple(_best(some) for some in found.values())

    def dataset(self, *, mirrored_after: float | None = None) -> xarray.Dataset:
        """Return the potential on the section, and the cheapest path, or their mirror images after a part of a period.

        The variables are those of `vibrokit.results.least_action.ActionGraphResult`, without ``source``.
        """
        grids = self.potential.grids
        later = round((mirrored_after or 0.0) * grids.steps) if grids.phases > 1 else 0
        nodes, values = self.potential.on_section(later)
        path = np.full((1, 3), np.nan)
        if self.candidates:
            times, states = self.candidates[0].times, self.candidates[0].states[later:]
            path = np.column_stack([times[: len(states)], states])
        if mirrored_after is not None:
            nodes, values, path = -nodes[::-1, ::-1], values[::-1, ::-1], path * [1.0, -1.0, -1.0]
        known, (t, x, v) = np.where(values < self.potential.ceiling, values, np.nan), path.T
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


def _best(energies: Sequence[ActivationEnergy]) -> ActivationEnergy:
    best = min(energies, key=lambda energy: (energy.upper, energy.value))
    lower = min(energy.lower for energy in energies)
    return best if best.lower == lower else dataclasses.replace(best, lower=lower)


def _bounded(energy: ActivationEnergy, estimate: TargetEstimate, action: float) -> ActivationEnergy:
    """An energy with bounds by the action of a whole path to the exit."""
    error = max(estimate.error, estimate.by_nodes + TOLERANCES.by_path * abs(action - energy.value))
    low, vague = min(energy.value, action), error > TOLERANCES.vague * action
    return dataclasses.replace(
        energy,
        value=action if vague and math.isfinite(action) else low,
        lower=max(0.0, low - error) if math.isfinite(error) else 0.0,
        upper=action,
        numerical_error=error,
    )


def _with_error(energy: ActivationEnergy, error: float) -> ActivationEnergy:
    """The same energy with another error."""
    return dataclasses.replace(energy, lower=max(0.0, energy.value - error), numerical_error=error)


def _array(dims: str | tuple[str, ...], values: object, units: str, long_name: str) -> xarray.Variable:
    return xarray.Variable(dims, values, {"units": units, "long_name": long_name})


@dataclasses.dataclass(eq=False)
class ExitCosts:
    """What reaching the exits of one attractor costs, as found on more and more nodes.

    All that was found is kept if the work is stopped.
    """

    search: HierarchySearch
    targets: Sequence[ExitTarget]
    shapes: Sequence[Shape]  # numbers of nodes, each twice the one before along both sides
    for_all: int  # of these numbers; others are for exits that the graph is too coarse for
    findings: tuple[Finding, ...]
    estimates: dict[ExitTarget, TargetEstimate] = dataclasses.field(default_factory=dict)
    potential: Potential | None = None  # on the finest grid that reaches the costliest target
    begun: int = 0  # numbers of nodes that were taken
    solved: int = 0  # numbers of nodes up to the last on which something was solved

    @property
    def finished(self) -> bool:
        """Whether there are no more nodes to take."""
        return self.begun == len(self.shapes)

    def refine(self, known: KnownPaths | None = None) -> None:
        """Solve on the next number of nodes, for all exits that known paths do not settle.

        Exits that cost far less than others, by known paths, are solved before these on grids of their own. Raises
        StructureError if no exit was reached on any number of nodes.
        """
        paths, nodes = known or KnownPaths(), self.shapes[self.begun]
        self.begun += 1
        unsettled = [each for each in (*self.targets, *self.search.embedded_targets(paths)) if paths.needs(each)]
        # Grids for targets that are no farther than the own basin cover that basin alone.
        both = ([target for target in unsettled if target.farther is farther] for farther in (True, False))
        for group, paths_of_group in (pair for together in both for pair in self.search.groups(together, paths)):
            try:
                self._solve(group, nodes, paths_of_group)
            except StructureError:  # on few nodes, no exit may be reached
                if self.begun >= self.for_all and not self.estimates:
                    self.begun = len(self.shapes)
                    raise

    def _solve(self, targets: Sequence[ExitTarget], nodes: Shape, known: KnownPaths) -> None:
        """Solve for some targets together, then for those that cost far less without the others.

        Raises StructureError if no target was reached.
        """
        estimates = self.estimates
        found, potential = self.search.estimates(targets, nodes, known)
        estimates |= {target: one for target, one in found.items() if np.isfinite(one.value) or target not in estimates}
        self.solved = self.begun
        if self.potential is None or _highest(targets, estimates) == _highest(estimates, estimates):
            self.potential = potential
        for _ in range(3):
            targets = _apart(targets, estimates, known)
            if not targets:
                break
            try:
                closer, _ = self.search.estimates(targets, nodes, known)
            except StructureError:  # too close to the attractor for any grid
                break
            targets = [target for target in targets if closer[target].error < estimates[target].error]
            estimates |= {target: closer[target] for target in targets}

    def solution(self) -> GraphSolution:
        """Return the solution for all targets so far; at least one number of nodes must have been solved."""
        reached = [
            (target, estimate)
            for target, estimate in sorted(self.estimates.items(), key=lambda entry: entry[1].value)
            if np.isfinite(estimate.value)
        ]
        potential, nodes = self.potential, self.shapes[self.solved - 1]
        assert potential is not None
        source, steps, stepper = self.search.problem.source, potential.grids.steps, repr(self.search.model.stepper)
        used = Finding.of(Code.GRAPH, source, nodes_x=nodes[0], nodes_v=nodes[1], steps=steps, stepper=stepper)
        cheapest = {label: estimate for target, estimate in reversed(reached) for label in target.labels}
        lost = [
            Finding.of(Code.GRAPH_PATH_LOST, source, label)
            for label, estimate in cheapest.items()
            if not estimate.candidates
        ]
        return GraphSolution(
            tuple(_energy(source, label, target, estimate) for target, estimate in reached for label in target.labels),
            tuple(estimate for target, estimate in reached for _ in target.labels),
            tuple(_labelled(reached)),
            potential,
            (used, *self.findings, *self._not_converged(), *lost),
            cheapest,
            max((max(steps) for shape, steps in self.search.steps_per_period.items() if shape > nodes), default=0),
            len(self.shapes) - self.solved,
            self.solved >= self.for_all,
        )

    def _not_converged(self) -> Iterator[Finding]:
        """What sweeps left open, if that matters."""
        part = max((estimate.unsettled for estimate in self.estimates.values()), default=0.0)
        if part > TOLERANCES.steps:
            yield Finding.of(Code.GRAPH_NOT_CONVERGED, self.search.problem.source, part=part)


def _energy(source: int, label: int, target: ExitTarget, estimate: TargetEstimate) -> ActivationEnergy:
    """The energy of one exit, without a path that bounds it from above."""
    return ActivationEnergy(
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
        if 0 < costs[target] < TOLERANCES.far_less * highest
        or (unknown and estimates[target].value > TOLERANCES.loose * known.cost(target))
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
