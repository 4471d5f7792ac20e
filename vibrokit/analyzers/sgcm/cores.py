"""Cores: sets around attractors in which a state has settled, and what the density around them needs."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.paths.local_potential import local_potential
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.analyzers.sgcm.density_grid import DensityGrid, nearest
from vibrokit.errors import StructureError
from vibrokit.results.attractor import Attractor
from vibrokit.results.region import Region
from vibrokit.structure.linear_map import gaussian_map
from vibrokit.structure.orbits import refine_orbit
from vibrokit.symbolic.flow_kind import Flow

_SIZE = 1.0  # semi-axes of a core in standard deviations of the density around the attractor: it holds 39 % of it
_LEAST = 2.5  # semi-axes of a core in node spacings, so that its area is known to a few per cent
_DEVIATIONS = 5.0  # of the density around the orbit that the region covers
_WIDER = 0.1  # of the width of the attractors' orbits, on each side of them
_SINGULAR = 1e-12  # 1 − correlation², as rounding errors may leave of 0
_BEYOND_FACE = 0.1  # of the region's width: what passes a face of the exit in a leg is still on the grid
_RELAXATION = 10.0  # section intervals in which the density on an attractor without multipliers forgets its start

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class CoreSets:
    """The cores on one grid at one intensity.

    Attributes
    ----------
    own : array (nx, nv)
        How much of each cell belongs to the core of the attractor that is left.
    others : mapping of int to array (nx, nv)
        By label: the same for the cores of others, or for their basins if those count; empty if position decides.
    entry : array (nx, nv)
        ln p, up to a constant, with which what has left is put back; −∞ outside the own core.
    """

    own: Array
    others: Mapping[int, Array]
    entry: Array


@dataclasses.dataclass(frozen=True, eq=False)
class Cores:
    """The cores of all attractors, as one of them is left.

    Attributes
    ----------
    problem : ExitProblem
    """

    problem: ExitProblem

    @cached_property
    def covariances(self) -> dict[int, Array]:
        """By label: the stationary covariances per unit D around the points of each attractor, shape (count, 2, 2)."""
        return {a.label: covariances_of(self.problem, a) for a in self.problem.structure.attractors}

    def on(self, grid: DensityGrid, intensity: float, every: int = 1) -> CoreSets:
        """Return the cores on a grid; of basins, so many cells are made one."""
        own = self._core(self.problem.attractor, grid, intensity)
        with np.errstate(divide="ignore"):
            entry: Array = self.start(grid, intensity) + np.log(own)
        if self.problem.exit.by_position:
            return CoreSets(own, {}, entry)
        others = [a for a in self.problem.structure.attractors if a.label != self.problem.source]
        if self.problem.exit.at_boundary:
            return CoreSets(own, {a.label: self._basin(a, grid, own, every) for a in others}, entry)
        return CoreSets(own, {a.label: self._core(a, grid, intensity) for a in others}, entry)

    def start(self, grid: DensityGrid, intensity: float) -> Array:
        """Return ln p, up to a constant, of normal distributions around the points of the attractor."""
        attractor = self.problem.attractor
        covariances = intensity * self.covariances[attractor.label]
        return -0.5 * nearest(grid.nodes, *_ellipses(attractor, covariances, 1.0, grid))

    def resolved(self, grid: DensityGrid, nodes: float) -> float:
        """Return the least intensity at which the density around the attractor is wider than some node spacings.

        What counts is its width in x at fixed v, and in v at fixed x. 0 for an attractor that never repeats, whose
        density is as wide as itself.
        """
        attractor = self.problem.attractor
        if not attractor.is_fixed:
            return 0.0
        inverse = np.linalg.inv(self.covariances[attractor.label])
        deviations = 1 / np.sqrt(np.diagonal(inverse, axis1=1, axis2=2)).max(axis=0)
        spacings = grid.local_spacing(attractor.points).max(axis=0)
        return float(((nodes * spacings / deviations) ** 2).max())

    def region(self, intensity: float) -> Region:
        """Return a rectangle around the structure's region, the attractors' orbits with the density, and the faces."""
        structure = self.problem.structure
        orbits = np.concatenate([attractor.orbit[:, :2] for attractor in structure.attractors])
        spread = np.diagonal(self.covariances[self.problem.source], axis1=1, axis2=2).max(axis=0)
        beyond = _DEVIATIONS * np.sqrt(intensity * spread)
        beyond = np.maximum(beyond, _WIDER * np.ptp(orbits, axis=0))
        low, high = orbits.min(axis=0) - beyond, orbits.max(axis=0) + beyond
        own = self._with_faces(structure.basins.region.bounds)
        return Region.of(np.stack([np.minimum(own[:, 0], low), np.maximum(own[:, 1], high)], axis=1))

    def _with_faces(self, bounds: Array) -> Array:
        """Bounds that hold the exit's faces; if x must be wider for that then v is too, as a motion there needs it."""
        faces, outward = self.problem.exit.faces(self.problem.osc), np.array([-1.0, 1.0])
        margins = _BEYOND_FACE * np.diff(bounds)
        beyond = np.where(np.isfinite(faces), np.maximum(outward * (faces - bounds) + margins, 0.0), 0.0)
        grown = np.max(beyond / np.diff(bounds))
        wider: Array = np.maximum(beyond, grown * np.diff(bounds) * np.isinf(faces))
        return bounds + outward * wider

    @property
    def relaxation(self) -> float:
        """Section intervals in which deviations of the density fall by a factor e."""
        attractor = self.problem.attractor
        largest = float(np.abs(attractor.multipliers).max()) if len(attractor.multipliers) else 0.0
        if not 0.0 < largest < 1.0 or not attractor.is_fixed:
            return _RELAXATION
        return max(1.0, -max(attractor.period, 1) / math.log(largest))

    def _basin(self, attractor: Attractor, grid: DensityGrid, own: Array, every: int) -> Array:
        """How much of each cell belongs to the basin of another attractor, and not to the own core."""
        basins = self.problem.structure.basins
        covered = grid.covered(lambda states: basins.at(states, every) == attractor.label)
        return np.minimum(covered, 1.0 - own)

    def _core(self, attractor: Attractor, grid: DensityGrid, intensity: float) -> Array:
        covariances = _SIZE**2 * intensity * self.covariances[attractor.label]
        ellipses = _ellipses(attractor, covariances, _LEAST, grid)
        return grid.covered(lambda states: nearest(states, *ellipses) <= 1)


def covariances_of(problem: ExitProblem, attractor: Attractor) -> Array:
    """Return the stationary covariances per unit D around the points of an attractor, shape (count, 2, 2).

    They are 0 for an attractor that never repeats: its points are a set of their own.

    Raises
    ------
    StructureError
        The orbit is not stable, or noise does not make it spread.
    """
    if not attractor.is_fixed:
        return np.zeros((len(attractor.points), 2, 2))
    stepper = problem.single_stepper(Flow.LINEARISED)
    orbit = refine_orbit(problem.osc, attractor.points[0], attractor.period, stepper)
    covariances = [local_potential(problem.osc, orbit, stepper).covariance]
    for point in attractor.points[:-1]:
        step = gaussian_map(problem.osc, point[None], stepper)
        covariances.append(step.derivatives[0] @ covariances[-1] @ step.derivatives[0].T + step.covariances[0])
    found = np.array(covariances)
    if not np.all(np.linalg.det(found) > _SINGULAR * found[:, 0, 0] * found[:, 1, 1]):
        raise StructureError("the noise is 0 on the attractor or nearly so: the density around it has no width.")
    return found


def _ellipses(attractor: Attractor, covariances: Array, least: float, grid: DensityGrid) -> tuple[Array, Array]:
    """Centres, and matrices R with Rᵀ R the inverse of the covariances; no semi-axis is below `least` node spacings."""
    points = attractor.points[:, :2]
    spacings = grid.local_spacing(points)
    if not attractor.is_fixed:
        spacings[:] = spacings.max(axis=0)
    scales = spacings[:, :, None] * spacings[:, None, :]
    variances, axes = np.linalg.eigh(covariances / scales)
    widened = np.einsum("nij,nj,nkj->nik", axes, np.maximum(variances, least**2), axes) * scales
    return points, np.linalg.cholesky(np.linalg.inv(widened)).transpose(0, 2, 1)
