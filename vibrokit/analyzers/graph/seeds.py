"""Seeds: the quasi-potential on and near the attractor, where it is known beforehand."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.graph.grids import Grids
from vibrokit.analyzers.graph.step_model import StepModel
from vibrokit.analyzers.paths.local_potential import cycle_potential, potential_along
from vibrokit.results.attractor import Attractor
from vibrokit.structure.orbits import refine_orbit

_SEED_REACH = 2.6  # nodes that the ellipse of seeds covers in x and in v: enough for interpolation next to it

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class Seeds:
    """What is known of the potential beforehand."""

    values: list[Array]  # (nx, nv) for each phase; infinite at nodes where the potential is not known
    orbit: Array  # (count, 2): the orbit from phase to phase, where paths may start; empty for a set


def seeds(model: StepModel, attractor: Attractor, grids: Grids) -> Seeds:
    """Return what is known of the potential at the nodes of each phase.

    Near the points of an orbit or of an equilibrium the potential is ½ δqᵀ Σ⁻¹ δq, with Σ carried from phase to phase
    by M Σ Mᵀ + C, as far as the motion is linear there. At the nodes next to a limit cycle it is the quadratic form
    across that, and at those next to another set of points it is 0. Raises StructureError if the attractor is not
    hyperbolic.
    """
    if attractor.is_fixed:
        return _around_orbit(model, attractor, grids)
    across = cycle_potential(model.scene, attractor, model.stepper) if attractor.kind == "limit cycle" else None
    points = attractor.points[:, :2] if attractor.kind != "limit cycle" else _dense(attractor.orbit, grids)
    values = []
    for phase in range(grids.phases):
        known = np.full(grids.shape, np.inf)
        corner = np.floor(grids.index(phase, points[grids.inside(phase, points)])).astype(np.int64)
        for more in ((0, 0), (0, 1), (1, 0), (1, 1)):
            known[tuple((corner + more).T)] = 0.0
        if across is not None:
            known[known == 0.0] = across.at(grids.nodes(phase)[known == 0.0])
        values.append(known)
        points = model.images(points, grids.time(phase), grids.step)
    return Seeds(values, np.empty((0, 2)))


@dataclasses.dataclass(frozen=True, eq=False)
class Visit:
    """One point of the orbit: its phase, Σ there, and the derivative M of the step from there."""

    phase: int
    point: Array
    covariance: Array
    slope: Array


def _around_orbit(model: StepModel, attractor: Attractor, grids: Grids) -> Seeds:
    visits = orbit_visits(model, attractor, grids)
    level = max(
        0.5 * float(np.max(np.diag(np.linalg.inv(visit.covariance)) * (_SEED_REACH * grids.spacing(visit.phase)) ** 2))
        for visit in visits
    )
    level = _linear_level(model, grids, visits, level)
    values = [np.full(grids.shape, np.inf) for _ in range(grids.phases)]
    for visit in visits:
        offset = grids.nodes(visit.phase) - visit.point
        form = 0.5 * np.einsum("...i,ij,...j->...", offset, np.linalg.inv(visit.covariance), offset)
        known = values[visit.phase]
        np.copyto(known, np.minimum(form, known), where=form <= level)
    return Seeds(values, np.array([visit.point for visit in visits]))


def orbit_visits(model: StepModel, attractor: Attractor, grids: Grids) -> list[Visit]:
    """Return the points of an orbit from phase to phase; raises StructureError if it is not hyperbolic."""
    orbit = refine_orbit(model.scene, attractor.points[0], attractor.period, model.stepper)
    along = potential_along(model.scene, orbit, model.stepper, grids.steps)
    count = attractor.period * grids.phases // len(grids.sections)
    return [
        Visit(number % grids.phases, here.point, here.covariance, after.monodromy)
        for number, (here, after) in enumerate(zip(along[:count], [*along[1:], along[0]], strict=False))
    ]


def _linear_level(model: StepModel, grids: Grids, visits: list[Visit], level: float) -> float:
    """Lower a level until the motion on its ellipses is linear in every step; 0 if it never is."""
    levels = level * 0.25 ** np.arange(40)
    angles = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    circle = np.stack([np.cos(angles), np.sin(angles)])
    sizes = np.sqrt(2 * levels)[:, None, None]
    worst = np.zeros(len(levels))
    for visit, after in zip(visits, [*visits[1:], visits[0]], strict=True):
        offsets = sizes * (np.linalg.cholesky(visit.covariance) @ circle).T  # (levels, angles, 2)
        states = visit.point + offsets
        images = model.images(states.reshape(-1, 2), grids.time(visit.phase), grids.step).reshape(states.shape)
        deviations = (images - after.point - offsets @ visit.slope.T) / sizes
        distances = np.linalg.norm(np.linalg.solve(np.linalg.cholesky(after.covariance), deviations.mT), axis=1)
        worst = np.maximum(worst, np.where(np.isfinite(distances), distances, np.inf).max(axis=1))
    linear = worst <= 0.02  # of the distance from the orbit
    return float(levels[np.argmax(linear)]) if linear.any() else 0.0


def _dense(curve: Array, grids: Grids) -> Array:
    """Points along a curve, several from node to node."""
    lengths = np.linalg.norm(np.diff(curve[:, :2], axis=0) / grids.spacing(0), axis=1)
    between = max(1, int(np.ceil(4 * lengths.max())))
    at = np.linspace(0, len(curve) - 1, between * (len(curve) - 1) + 1)
    return np.column_stack([np.interp(at, np.arange(len(curve)), curve[:, axis]) for axis in (0, 1)])
