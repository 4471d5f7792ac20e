"""Traced paths: those that a potential leads along to its exit targets, priced by Hamilton's equations."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable

import numpy as np

from vibrokit.analyzers.graph.backtracking import backtrack
from vibrokit.analyzers.graph.potential import Potential
from vibrokit.analyzers.graph.step_model import StepModel
from vibrokit.analyzers.graph.targets import Arrival, ExitTarget, TraceStart
from vibrokit.analyzers.paths.action_descent import descend_action
from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.paths.gauss_newton import gauss_newton
from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.errors import StructureError
from vibrokit.symbolic.flow_kind import Flow

METHOD = "graph"
_FEWEST = 3  # nodes of a path with anything between its ends to relax
_SAME = 1e-4  # relative difference of the actions of paths that count as one


@dataclasses.dataclass(frozen=True, eq=False)
class TracedPath:
    """A path to an exit target, relaxed to a local minimum of the action."""

    candidate: Candidate  # priced by Hamilton's equations, except for the quadratic form that it starts in
    quadratic: float  # its cost as the graph computes it, with linearized steps

    @property
    def linearization_error(self) -> float:
        """Relative difference that linearization over a step makes."""
        return abs(self.quadratic - self.candidate.action) / self.candidate.action


class SolvedGrid:
    """A potential with its exit targets, each evaluated and traced once."""

    def __init__(self, problem: ExitProblem, model: StepModel, potential: Potential) -> None:
        self.problem, self.model, self.potential = problem, model, potential
        self._arrivals: dict[ExitTarget, Arrival] = {}
        self._paths: dict[ExitTarget, list[TracedPath]] = {}

    def arrival(self, target: ExitTarget) -> Arrival:
        """Return what reaching a target costs."""
        if target not in self._arrivals:
            self._arrivals[target] = target.evaluate(self.potential)
        return self._arrivals[target]

    def highest(self, targets: Iterable[ExitTarget]) -> float:
        """Return the cost of the costliest of those targets that are reached; infinite if none is."""
        values = [self.arrival(target).value for target in targets]
        return max((value for value in values if np.isfinite(value)), default=np.inf)

    def paths(self, target: ExitTarget) -> list[TracedPath]:
        """Return the distinct paths to a target, the cheapest first."""
        if target not in self._paths:
            arrival = self.arrival(target)
            traced = [self._traced(target.label, arrival.value, start) for start in arrival.starts]
            self._paths[target] = distinct(path for path in traced if path is not None)
        return self._paths[target]

    def _traced(self, label: int, value: float, start: TraceStart) -> TracedPath | None:
        problem, potential = self.problem, self.potential
        found = backtrack(self.model, potential, start.state, start.phase)
        if found is None or len(found[0]) < _FEWEST:
            return None
        states, before = found
        pieces = round(problem.scene.section_interval / potential.grids.step)
        stepper = problem.single_stepper(Flow.HAMILTONIAN_VARIATIONAL)
        propagator = SegmentPropagator(problem.scene, stepper, pieces)
        try:
            points, quadratic = gauss_newton(propagator, 0, states)
        except StructureError:
            return None
        points, action = descend_action(propagator, 0, points)
        if not np.isfinite(action):
            return None
        if len(start.beyond):
            before += max(0.0, value - float(potential.at(start.phase, start.state[None])[0]))
        states = np.concatenate([points[:, : propagator.size], start.beyond])
        times = potential.grids.step * np.arange(len(states), dtype=float)
        candidate = Candidate(problem.source, label, times, states, before + action, METHOD)
        return TracedPath(candidate, before + quadratic)


def distinct(paths: Iterable[TracedPath]) -> list[TracedPath]:
    """Return each path once, the cheapest first."""
    kept: list[TracedPath] = []
    for path in sorted(paths, key=lambda path: path.candidate.action):
        action = path.candidate.action
        if not any(abs(action - other.candidate.action) <= _SAME * action for other in kept):
            kept.append(path)
    return kept
