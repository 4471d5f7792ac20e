"""Seeds: nodes where the quasi-potential is known, on and round the attractor."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.quasi_potential import local_potential
from vibrokit.analyzers.screening.grids import Grids
from vibrokit.analyzers.screening.tables import carried, forward
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.structure.orbits import refine_orbit
from vibrokit.symbolic.flow_kind import Flow

_REACH = 2.6  # cells that the ellipse of given nodes covers in x and in v
_FINE = 4  # points of a curve per cell
_ANGLES = 24
_CURVED = 0.02  # of the distance from the orbit: by how much an image may differ from the linear one
_LOWER, _LOWERED = 0.25, 40

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class Seeds:
    """What is known of the potential beforehand.

    Attributes
    ----------
    values : list of array (nx, nv)
        By phase; infinite at nodes where it is not known.
    orbit : array (count, 2)
        The orbit from phase to phase, which paths may leave from anywhere along it; empty for a set.
    """

    values: list[Array]
    orbit: Array

    def visits(self, phase: int) -> Array:
        """Points of the orbit at a phase, shape (period, 2)."""
        return self.orbit[phase :: len(self.values)]


def seeds(osc: Oscillator, stepper: Stepper, attractor: Attractor, grids: Grids) -> Seeds:
    """Return what is known of the potential at the nodes of each phase.

    Round the points of an orbit or of an equilibrium it is ½ δqᵀ Σ⁻¹ δq, with Σ carried from phase to phase by
    M Σ Mᵀ + C, as far as the motion is linear there. An attractor that meets the section in a curve or a cloud has 0 at
    the nodes next to it.

    Raises
    ------
    StructureError
        The attractor is not hyperbolic.
    """
    if attractor.is_fixed:
        return _ellipses(osc, stepper, attractor, grids)
    points = attractor.points[:, :2] if attractor.kind != "limit cycle" else _filled(attractor.orbit, grids)
    known = []
    for phase in range(grids.phases):
        values = np.full(grids.cells, np.inf)
        inside = points[grids.inside(phase, points)]
        corner = np.floor(grids.places(phase, inside)).astype(np.int64)
        for more in ((0, 0), (0, 1), (1, 0), (1, 1)):
            values[tuple((corner + more).T)] = 0.0
        known.append(values)
        points = run_ensemble(
            osc, Flow.STATE, stepper, points, 1, start_time=grids.time(phase), interval=grids.step
        ).states  # fmt: skip
    return Seeds(known, np.empty((0, 2)))


@dataclasses.dataclass(frozen=True, eq=False)
class _Visit:
    """One point of the orbit: its phase, Σ there, and the slope of the step from there."""

    phase: int
    point: Array
    covariance: Array
    slope: Array


def _ellipses(osc: Oscillator, stepper: Stepper, attractor: Attractor, grids: Grids) -> Seeds:
    visits = _visits(osc, stepper, attractor, grids)
    level = max(
        0.5 * float(np.max(np.diag(np.linalg.inv(visit.covariance)) * (_REACH * grids.spacing(visit.phase)) ** 2))
        for visit in visits
    )
    level = _linear_level(osc, stepper, grids, visits, level)
    known = [np.full(grids.cells, np.inf) for _ in range(grids.phases)]
    for visit in visits:
        offset = grids.nodes(visit.phase) - visit.point
        values = 0.5 * np.einsum("...i,ij,...j->...", offset, np.linalg.inv(visit.covariance), offset)
        known[visit.phase] = np.where(values <= level, np.minimum(values, known[visit.phase]), known[visit.phase])
    return Seeds(known, np.array([visit.point for visit in visits]))


def _visits(osc: Oscillator, stepper: Stepper, attractor: Attractor, grids: Grids) -> list[_Visit]:
    orbit = refine_orbit(osc, attractor.points[0], attractor.period, stepper)
    covariance, point = local_potential(osc, orbit, stepper).covariance, orbit.point
    visits = []
    for number in range(attractor.period * grids.phases):
        phase = number % grids.phases
        images, slopes, gramians = forward(osc, stepper, point[None], grids.time(phase), grids.step)
        visits.append(_Visit(phase, point, covariance, slopes[0]))
        point, covariance = images[0], slopes[0] @ covariance @ slopes[0].T + gramians[0]
    return visits


def _linear_level(osc: Oscillator, stepper: Stepper, grids: Grids, visits: list[_Visit], level: float) -> float:
    """Lower a level until the motion on its ellipses is linear in every step; 0 if it never is."""
    angles = np.linspace(0, 2 * np.pi, _ANGLES, endpoint=False)
    circle = np.stack([np.cos(angles), np.sin(angles)])
    for _ in range(_LOWERED):
        worst = 0.0
        for visit, after in zip(visits, [*visits[1:], visits[0]], strict=True):
            offset = (np.linalg.cholesky(2 * level * visit.covariance) @ circle).T
            images = carried(osc, stepper, visit.point + offset, grids.time(visit.phase), grids.step)
            miss = images - after.point - offset @ visit.slope.T
            size = np.linalg.norm(np.linalg.solve(np.linalg.cholesky(2 * level * after.covariance), miss.T), axis=0)
            worst = max(worst, float(np.where(np.isfinite(size), size, np.inf).max()))
        if worst <= _CURVED:
            return level
        level *= _LOWER
    return 0.0


def _filled(curve: Array, grids: Grids) -> Array:
    """Points along a curve, so dense that no cell is jumped."""
    lengths = np.linalg.norm(np.diff(curve[:, :2], axis=0) / grids.spacing(0), axis=1)
    dense = max(1, int(np.ceil(_FINE * lengths.max())))
    at = np.linspace(0, len(curve) - 1, dense * (len(curve) - 1) + 1)
    return np.column_stack([np.interp(at, np.arange(len(curve)), curve[:, axis]) for axis in (0, 1)])
