"""Tracing: a path from an exit target back to the attractor, step by step on the grid."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.graph.potential import Potential
from vibrokit.analyzers.graph.step_model import StepCosts, StepModel
from vibrokit.analyzers.graph.targets import Arrival, ExitTarget, TraceStart
from vibrokit.analyzers.graph.traced_path import TracedPath, distinct, lead_in
from vibrokit.analyzers.paths.action_descent import descend_action
from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.paths.gauss_newton import gauss_newton
from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.errors import StructureError
from vibrokit.kernels.sweeps import descend_all
from vibrokit.symbolic.flow_kind import Flow

METHOD = "graph"
_STEP_WEIGHT = 1 / 1.1  # of a step's cost against V: below 1, so that no path lingers near an unstable orbit
_CORNERS = np.array([(0, 0), (0, 1), (1, 0), (1, 1)])

Array = NDArray[np.float64]


class SolvedGrid:
    """A potential with its exit targets, each evaluated and traced once."""

    def __init__(self, problem: ExitProblem, model: StepModel, potential: Potential) -> None:
        self.problem, self.model, self.potential = problem, model, potential
        self._arrivals: dict[ExitTarget, Arrival] = {}
        self._paths: dict[ExitTarget, list[TracedPath]] = {}

    @property
    def steps(self) -> int:
        """Steps in a section interval."""
        return self.potential.grids.steps

    @property
    def intervals(self) -> int:
        """Section intervals that have grids of their own."""
        return len(self.potential.grids.sections)

    def arrival(self, target: ExitTarget) -> Arrival:
        """Return what reaching a target costs."""
        if target not in self._arrivals:
            self._arrivals[target] = target.evaluate(self.potential)
        return self._arrivals[target]

    def highest(self, targets: Iterable[ExitTarget]) -> float:
        """Return the cost of the costliest of those targets that are reached; infinite if none is."""
        values = [self.arrival(target).value for target in targets]
        return max((value for value in values if np.isfinite(value)), default=np.inf)

    def linearization_error(self, targets: Iterable[ExitTarget]) -> float:
        """Return the largest relative change of a reached exit's cost by linearization over a step.

        Infinite if no path to one of them could be traced.
        """
        traced = [self.paths(target) for target in targets if np.isfinite(self.arrival(target).value)]
        return max((max((path.linearization_error for path in paths), default=np.inf) for paths in traced), default=0.0)

    def change(self, rougher: SolvedGrid, targets: Iterable[ExitTarget]) -> float:
        """Return the largest relative change of an exit's cost from another grid."""
        found = [(self.arrival(target).value, rougher.arrival(target).value) for target in targets]
        known = [both for both in found if np.isfinite(both).all() and both[0] > 0]
        return max((abs(rough / value - 1) for value, rough in known), default=0.0)

    def ratios(self, targets: Iterable[ExitTarget]) -> list[float]:
        """V at each reached exit in units of the action of the path to it; infinite where no path could be traced."""
        found = [(self.arrival(target).value, target) for target in targets]
        traced = [(value, self.paths(target)) for value, target in found if np.isfinite(value)]
        return [value / paths[0].candidate.action if paths else np.inf for value, paths in traced]

    def paths(self, target: ExitTarget) -> list[TracedPath]:
        """Return the distinct paths to a target, the cheapest first."""
        if target not in self._paths:
            arrival = self.arrival(target)
            traced = [self._traced(target, arrival.value, start) for start in arrival.starts]
            self._paths[target] = distinct(path for path in traced if path is not None)
        return self._paths[target]

    def _traced(self, target: ExitTarget, value: float, start: TraceStart) -> TracedPath | None:
        problem, potential, fixed = self.problem, self.potential, self.problem.attractor.is_fixed
        found = backtrack(self.model, potential, start.state, start.phase)
        if found is None or len(found[0]) < 3:  # nothing between its ends to relax
            return None
        states, before = found
        stepper = problem.single_stepper(Flow.HAMILTONIAN_VARIATIONAL)
        propagator = SegmentPropagator(problem.scene, stepper, self.steps)
        lead = np.empty((0, 2)) if fixed else lead_in(problem.attractor, propagator, states[0])
        states, before = np.concatenate([lead, states]), before if fixed else 0.0
        try:
            points, quadratic = gauss_newton(propagator, 0, states)
        except StructureError:
            return None
        # Enough for generic paths, and below the error of V on the default grid; polishing goes on from there.
        points, action = descend_action(propagator, 0, points, iterations=30, converged=1e-3)
        if not np.isfinite(action):
            return None
        if len(start.beyond):
            before += max(0.0, value - float(potential.at(start.phase, start.state[None])[0]))
        relaxed = points[:, : propagator.size]
        states = np.concatenate([relaxed[len(lead) :], start.beyond])
        times = potential.grids.step * np.arange(len(states), dtype=float)
        candidate = Candidate(problem.source, target.labels[0], times, states, before + action, METHOD)
        on_attractor = not fixed or found[1] == 0.0
        return TracedPath(candidate, before + quadratic, relaxed, self.steps, on_attractor, target, start)


def backtrack(model: StepModel, potential: Potential, end: Array, phase: int = 0) -> tuple[Array, float] | None:
    """Trace the cheapest path to a state of a phase back to seeded nodes, or to the orbit itself.

    The costs of steps are computed anew for each state, not taken from the nodes.

    Returns the states (count, 2) in the order of time, a step apart, the first on the section, and V at the first of
    them; None if the path does not reach the attractor.
    """
    grids = potential.grids
    states = [end]
    per_interval = grids.steps
    weight, lowest = _STEP_WEIGHT, np.inf
    for count in range(1, 250 * per_interval):
        before = (phase - count) % grids.phases
        costs = model.into(states[-1][None], grids, before)
        tries = _tries(potential, before, states[-1], costs)
        totals, index = descend_all(potential.values[before], tries[None], costs.centres, costs.roots, weight)
        visit = _on_orbit(potential, before, costs, float(totals[0]))
        if visit is not None:
            return np.array([*potential.orbit[visit - before : visit + 1], *states[::-1]]), 0.0
        states.append(grids.states(before, index[0]))
        if not np.isfinite(costs.cost(index)[0]):
            return None
        if count % per_interval == 0:
            lower = totals[0] < 0.999 * lowest
            weight = _STEP_WEIGHT if lower else weight / 2  # V, interpolated, may have a hollow that it never leaves
            lowest = min(lowest, float(totals[0]))
            if weight < 1e-4:
                return None
        nearest = np.clip(np.rint(index[0]), 0, np.array(grids.shape) - 1).astype(int)
        if before == 0 and potential.seeded[tuple(nearest)]:
            return np.array(states[::-1]), float(potential.at(0, states[-1][None])[0])
    return None


def _tries(potential: Potential, before: int, state: Array, costs: StepCosts) -> Array:
    """Where descents begin, shape (6, 2): b itself, predecessors of the nodes around the state, and uphill."""
    grids = potential.grids
    after = (before + 1) % grids.phases
    corner = np.floor(grids.index(after, state)).astype(int) + _CORNERS
    corner = np.clip(corner, 0, np.array(grids.shape) - 1)
    return np.concatenate([costs.centres, potential.predecessors[before][tuple(corner.T)], costs.uphill])


def _on_orbit(potential: Potential, before: int, costs: StepCosts, total: float) -> int | None:
    """Which point of the orbit the step starts from, if that costs less than any other start."""
    grids = potential.grids
    visits = np.arange(before, len(potential.orbit), grids.phases)
    direct = costs.cost(grids.index(before, potential.orbit[visits]))
    if not len(visits) or not direct.min() <= total:
        return None
    return int(visits[np.argmin(direct)])
