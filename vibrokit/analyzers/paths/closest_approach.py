"""Closest approach: from where a chaotic attractor comes nearest to a saddle on its basin boundary, to that saddle."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.path_ends import AtSaddle
from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.structure.linear_map import gaussian_map
from vibrokit.symbolic.flow_kind import Flow

FINDER = "closest approach"
_BEFORE = 16  # section intervals on the attractor before noise acts

Array = NDArray[np.float64]


def closest_approaches(problem: ExitProblem) -> list[Candidate]:
    """Return candidates that follow a chaotic attractor and end on an orbit on its basin boundary.

    The motion within the attractor costs no action. What noise costs after it is estimated by the motion linearized
    over the intervals in which it acts. Near a boundary crisis this is too little for any grid.
    """
    attractor, osc = problem.attractor, problem.scene
    if attractor.kind != "chaotic" or osc.autonomous or attractor.points.shape[1] > 2:
        return []
    stepper, best = problem.ensemble_stepper(Flow.LINEARISED), dict[int, Candidate]()
    own = [end for end in problem.path_ends if isinstance(end, AtSaddle) and end.on_own_boundary]
    for acting in (1, 2, 4):  # section intervals in which noise acts
        starts = attractor.points[_BEFORE:-acting]
        reached = gaussian_map(osc, starts, stepper, intervals=acting)
        for end in own:
            saddle = problem.structure.saddles[end.number]
            if not saddle.period:  # a chaotic set; the orbits inside it are ends of their own
                continue
            costs = _costs(saddle.points, reached.images, reached.covariances)
            place, goal = np.unravel_index(int(np.argmin(costs)), costs.shape)
            known = best.get(end.number)
            if known is None or costs[place, goal] < known.action:
                states = np.vstack([attractor.points[place : place + _BEFORE + acting], saddle.points[goal]])
                times = osc.section_interval * np.arange(len(states), dtype=np.float64)
                action = float(costs[place, goal])
                best[end.number] = Candidate(problem.source, end.targets[0], times, states, action, FINDER)
    return sorted(best.values(), key=lambda each: each.action)[:4]


def _costs(goals: Array, images: Array, covariances: Array) -> Array:
    """½ eᵀ C⁻¹ e of reaching goals (m, 2) instead of images (count, 2): (count, m), infinite if C is singular."""
    offsets = goals - images[:, None]
    with np.errstate(all="ignore"):
        (a, b), (_, c) = np.moveaxis(covariances, 0, -1)
        spread = (a * c - b**2)[:, None]
        x, v = np.moveaxis(offsets, -1, 0)
        costs: Array = 0.5 * (c[:, None] * x**2 - 2 * b[:, None] * x * v + a[:, None] * v**2) / spread
    return np.where(np.isfinite(costs) & (spread > 0), costs, np.inf)
