"""Importance functions: scores by which splitting ranks states on their way out. Any of them gives unbiased rates."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.metastability import metrics_of, nearest
from vibrokit.analyzers.mfet.walk import Walk
from vibrokit.analyzers.paths.local_potential import potential_along
from vibrokit.kernels.climbing import climb
from vibrokit.results.attractor import Attractor
from vibrokit.structure.orbits import refine_orbit
from vibrokit.symbolic.flow_kind import Flow

_TIMES = 16  # in a section interval

Array = NDArray[np.float64]
Whole = NDArray[np.int64]


@dataclasses.dataclass(frozen=True, eq=False)
class Importance:
    """A score on nodes and at several times, larger the closer a state is to an exit."""

    times: Array  # (stages,): in section intervals, ascending from 0; at the next section the first one holds again
    x: Array
    v: Array
    values: Array  # (stages, nx, nv)
    depth: float  # ln of the probability to leave, from the attractor to the exit; a guess if it is not known

    def records(self, visits: Array, counts: Whole, phases: Whole, looks: int, highest: Array) -> Array:
        """Return the scores of states that are higher than all before in their row, −∞ elsewhere; raise `highest`.

        `visits` (count, most, n) has so many states in each row as `counts` says. There are so many looks in a section
        interval; `phases` are those from a section to the start of each row.
        """
        scores = np.empty(visits.shape[:2])
        climb(visits, counts, phases, looks, self.times, self.x, self.v, self.values, highest, scores)
        return scores


def from_distances(walk: Walk) -> Importance:
    """Return a / (a + b), with the squared distances a from the attractor and b from the nearest other exit.

    That is another attractor, or a bound beyond which motion has left. Distances are in standard deviations of the
    densities around the attractors, which move with the forcing. This is a score where no density is at hand; the more
    the motion turns on its way out, the less good. The depth is not known; 20 is a guess.
    """
    problem, region = walk.problem, walk.problem.structure.basins.region
    bounds = np.stack([region.bounds, np.where(np.isfinite(problem.faces), problem.faces, region.bounds)])
    x, v = (
        np.linspace(low - 0.25 * (high - low), high + 0.25 * (high - low), 160)
        for low, high in zip(bounds[:, :, 0].min(axis=0), bounds[:, :, 1].max(axis=0), strict=True)
    )
    nodes = np.stack(np.meshgrid(x, v, indexing="ij"), axis=-1)
    times = np.arange(_TIMES) / _TIMES
    own = _distances(walk, problem.attractor, nodes)
    others = [_distances(walk, a, nodes) for a in problem.structure.attractors if a.label != problem.source]
    others += [np.broadcast_to(each, own.shape) for each in _distances_from_faces(walk, nodes)]
    to_others = np.min(others, axis=0) if others else np.full_like(own, own.max())
    values = own / (own + to_others)
    return Importance(times, x, v, values, 20.0)


def _distances_from_faces(walk: Walk, nodes: Array) -> list[Array]:
    """Squared distances of nodes from each bound beyond which motion has left, shape (nx, nv); 0 beyond it."""
    root, found = walk.own.metrics[0], []
    for axis, side in np.argwhere(np.isfinite(walk.problem.faces)).tolist():
        inward = (1.0 if side else -1.0) * (walk.problem.faces[axis, side] - nodes[..., axis])
        found.append(np.maximum(inward, 0.0) ** 2 * float(root[:, axis] @ root[:, axis]))
    return found


def _distances(walk: Walk, attractor: Attractor, nodes: Array) -> Array:
    """Squared distances of nodes from an attractor at the times of a section interval, shape (times, nx, nv)."""
    if not attractor.is_fixed:
        stop = walk.around([attractor])
        return np.repeat(nearest(nodes, stop.points, stop.metrics, stop.turn)[None], _TIMES, axis=0)
    stepper = walk.problem.single_stepper(Flow.LINEARISED)
    orbit = refine_orbit(walk.problem.osc, attractor.points[0], attractor.period, stepper)
    phases = potential_along(walk.problem.osc, orbit, stepper)
    found = []
    for first in range(_TIMES):
        here = phases[first::_TIMES]
        covariances = walk.intensity * np.array([phase.covariance[:2, :2] for phase in here])
        least = 1e-9 * np.sqrt(np.diagonal(covariances, axis1=1, axis2=2))
        points = walk.problem.on_turn(np.array([phase.point[:2] for phase in here]))
        found.append(nearest(nodes, points, metrics_of(attractor, covariances, least), walk.problem.turn))
    return np.array(found)
