"""Cores: sets around attractors in which a state has settled, and the densities that start there."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.paths.local_potential import local_potential
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.analyzers.sgcm.density_grid import DensityGrid
from vibrokit.results.attractor import Attractor
from vibrokit.structure.linear_map import gaussian_map
from vibrokit.structure.orbits import refine_orbit
from vibrokit.symbolic.flow_kind import Flow

_SIZE = 0.5  # semi-axes of a core in standard deviations of the density around the attractor
_LEAST = 2.5  # semi-axes of a core in node spacings, so that its area is known to a few per cent

Array = NDArray[np.float64]


def covariances_of(problem: ExitProblem, attractor: Attractor) -> Array:
    """Return the stationary covariances per unit D around the points of an attractor, shape (count, 2, 2).

    They are 0 for an attractor that never repeats: its points are a set of their own.

    Raises
    ------
    StructureError
        The orbit is not stable.
    """
    if not attractor.is_fixed:
        return np.zeros((len(attractor.points), 2, 2))
    stepper = problem.single_stepper(Flow.LINEARISED)
    orbit = refine_orbit(problem.osc, attractor.points[0], attractor.period, stepper)
    covariances = [local_potential(problem.osc, orbit, stepper).covariance]
    for point in attractor.points[:-1]:
        step = gaussian_map(problem.osc, point[None], stepper)
        covariances.append(step.derivatives[0] @ covariances[-1] @ step.derivatives[0].T + step.covariances[0])
    return np.array(covariances)


def core(attractor: Attractor, covariances: Array, intensity: float, grid: DensityGrid) -> Array:
    """Return how much of each cell belongs to the core of an attractor, from 0 to 1, shape (nx, nv)."""
    return grid.covered(*_ellipses(attractor, _SIZE**2 * intensity * covariances, _LEAST, grid))


def around(attractor: Attractor, covariances: Array, intensity: float, grid: DensityGrid) -> Array:
    """Return ln p, up to a constant, of normal distributions around the points of an attractor."""
    return -0.5 * grid.nearest(*_ellipses(attractor, intensity * covariances, 1.0, grid))


def deviations(covariances: Array) -> Array:
    """Return the least conditional standard deviations of x and of v around an attractor per √D, shape (2,).

    They are what a grid has to resolve: the width of the density in x at fixed v, and in v at fixed x.
    """
    narrowest: Array = 1 / np.sqrt(np.diagonal(np.linalg.inv(covariances), axis1=1, axis2=2)).max(axis=0)
    return narrowest


def _ellipses(attractor: Attractor, covariances: Array, least: float, grid: DensityGrid) -> tuple[Array, Array]:
    """Centres, and matrices R with Rᵀ R the inverse of the covariances, widened by `least` node spacings."""
    points = attractor.points[:, :2]
    spacings = grid.local_spacing(points)
    if not attractor.is_fixed:
        spacings[:] = spacings.max(axis=0)
    widened = covariances + ((least * spacings) ** 2)[:, :, None] * np.eye(2)
    return points, np.linalg.cholesky(np.linalg.inv(widened)).transpose(0, 2, 1)
