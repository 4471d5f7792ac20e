"""Backtracking: a path traced from its end, step by step, to the attractor."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.graph.potential import Potential
from vibrokit.analyzers.graph.step_model import StepCosts, StepModel
from vibrokit.kernels.sweeps import descend_all

_LONGEST = 250  # section intervals
_STEP_WEIGHT = 1 / 1.1  # of a step's cost against V: below 1, so that no path lingers near an unstable orbit
_LIGHTER, _LEAST_WEIGHT = 0.5, 1e-4  # where V, interpolated, has a hollow that a path would never leave
_LOSS = 1e-3  # of V, that a path has to lose in a section interval; else the weight is lowered
_CORNERS = np.array([(0, 0), (0, 1), (1, 0), (1, 1)])

Array = NDArray[np.float64]


def backtrack(model: StepModel, potential: Potential, end: Array, phase: int = 0) -> tuple[Array, float] | None:
    """Trace the cheapest path to a state of a phase back to seeded nodes, or to the orbit itself.

    The costs of steps are computed anew for each state, not taken from the nodes.

    Returns the states (count, 2) in the order of time, a step apart, the first on the section, and V at the first of
    them; None if the path does not reach the attractor.
    """
    grids = potential.grids
    states = [end]
    per_interval = round(model.scene.section_interval / grids.step)
    weight, level = _STEP_WEIGHT, np.inf
    for count in range(1, _LONGEST * per_interval):
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
            weight = _STEP_WEIGHT if totals[0] < (1 - _LOSS) * level else max(weight * _LIGHTER, _LEAST_WEIGHT)
            level = float(totals[0])
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
