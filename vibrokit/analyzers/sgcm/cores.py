"""Cores: sets around attractors in which a state has settled, and the region that the density around them needs.

A state has also settled where noise does not bring it back: in another basin, farther from its edge than noise moves
states around the attractors. So a grid need not cover another attractor whose basin is wider than that.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import minimum_filter

from vibrokit.analyzers.metastability import core_of, covariances_of, nearest, relaxation_of, targets_at
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.analyzers.sgcm.density_grid import DensityGrid
from vibrokit.results.attractor import Attractor
from vibrokit.results.basins import UNSETTLED
from vibrokit.results.region import Region

# Deviations from the edge of a basin, beyond which a state in it counts as settled. On hertz-0.570, ln of the rate from
# the clear orbit changes by 0.003 at D = 5e-6; with 5 by 0.042 at D = 2e-5, since transients pass the edge again.
_COMMITTED = 10.0
_WIDER = 0.1  # of the width of the orbits and of the region: what passes a face in a leg is still on the grid

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class CoreSets:
    """The cores on one grid at one intensity, as shares of each cell, shape (nx, nv)."""

    own: Array  # of the attractor that is left
    others: Mapping[int, Array]  # by label: cores and cells committed to them, or basins; empty if position decides
    entry: Array  # ln ρ, up to a constant, of states that have left and are put back; −∞ outside the own core
    outlet: int | None  # target of what leaves by position, at any time; None if nothing does
    committed: Array  # of each cell, what absorbs because of the basin that it is in


@dataclasses.dataclass(frozen=True, eq=False)
class Cores:
    """The cores of all attractors, as one of them is left."""

    problem: ExitProblem

    def on(
        self, grid: DensityGrid, intensity: float, every: int = 1, larger: float = 1.0, nearer: float = 1.0
    ) -> CoreSets:
        """Return the cores on a grid, larger by a factor; of basins, so many cells are made one.

        States are settled `nearer` to the edge of a basin by a factor: with 0 only in the core.
        """
        own = self._core(self.problem.attractor, grid, intensity, larger)
        with np.errstate(divide="ignore"):
            entry: Array = self.start(grid, intensity) + np.log(own)
        outlet, targets = self.problem.outlet, self.problem.targets
        others: dict[int, Array] = {}
        committed = np.zeros_like(own)
        if self.problem.exit.at_boundary:
            labels = [a.label for a in targets] + ([] if outlet is None else [outlet])
            others = {label: self._basin(label, grid, own, every) for label in labels}
            committed = np.minimum(sum(others.values(), committed), 1.0)
        elif not self.problem.exit.by_position:
            settled = targets_at(self.problem, intensity) or targets  # exploration may take more noise than is wanted
            others = {a.label: self._core(a, grid, intensity, larger) for a in settled}
            for label in others if nearer else ():
                inner = self._inner(label, grid, own, _COMMITTED * math.sqrt(intensity) / nearer)
                committed, others[label] = np.maximum(committed, inner), np.maximum(others[label], inner)
        return CoreSets(own, others, entry, outlet, committed)

    def start(self, grid: DensityGrid, intensity: float) -> Array:
        """Return ln ρ, up to a constant, of normal distributions around the points of the attractor."""
        ellipses = core_of(self.problem, self.problem.attractor, intensity, resolved=grid.local_spacing)
        return -0.5 * nearest(grid.nodes, *ellipses, self.problem.turn)

    def resolved(self, grid: DensityGrid, nodes: float) -> float:
        """Return the least intensity at which the density around the attractor is wider than some node spacings.

        What counts is its width in x at fixed v, and in v at fixed x. 0 for an attractor that never repeats, whose
        density is as wide as itself.
        """
        attractor = self.problem.attractor
        if not attractor.is_fixed:
            return 0.0
        inverse = np.linalg.inv(covariances_of(self.problem, attractor))
        deviations = 1 / np.sqrt(np.diagonal(inverse, axis1=1, axis2=2)).max(axis=0)
        spacings = grid.local_spacing(attractor.points).max(axis=0)
        return float(((nodes * spacings / deviations) ** 2).max())

    def region(self, intensity: float) -> Region:
        """Return a rectangle around the structure's region, the attractors' orbits with the density, and the faces."""
        structure = self.problem.structure
        orbits = np.concatenate([attractor.orbit[:, :2] for attractor in structure.attractors])
        spread = self._spread(self.problem.attractor)
        beyond = np.maximum(5.0 * np.sqrt(intensity * spread), _WIDER * np.ptp(orbits, axis=0))
        low, high = orbits.min(axis=0) - beyond, orbits.max(axis=0) + beyond
        own = self._with_faces(structure.basins.region.bounds)
        found = np.stack([np.minimum(own[:, 0], low), np.maximum(own[:, 1], high)], axis=1)
        return Region.of([structure.region.x, found[1]] if self.problem.turn else found)

    def _with_faces(self, bounds: Array) -> Array:
        """Bounds that hold the exit's faces; if x must be wider for that then v is too, as a motion there needs it."""
        faces, outward = self.problem.faces, np.array([-1.0, 1.0])
        margins = _WIDER * np.diff(bounds)
        beyond = np.where(np.isfinite(faces), np.maximum(outward * (faces - bounds) + margins, 0.0), 0.0)
        grown = np.max(beyond / np.diff(bounds))
        wider: Array = np.maximum(beyond, grown * np.diff(bounds) * np.isinf(faces))
        return bounds + outward * wider

    @property
    def relaxation(self) -> float:
        """Section intervals in which deviations of the density fall by a factor e."""
        return relaxation_of(self.problem.attractor, self.problem.osc.section_interval)

    def _basin(self, label: int, grid: DensityGrid, own: Array, every: int) -> Array:
        """How much of each cell belongs to the basin of another attractor or to escape, and not to the own core."""
        basins, problem = self.problem.structure.basins, self.problem
        covered = grid.covered(lambda states: basins.at(problem.on_turn(states), every) == label)
        return np.minimum(covered, 1.0 - own)

    def _inner(self, label: int, grid: DensityGrid, own: Array, deviations: float) -> Array:
        """How much of each cell is in a basin, so far from its edge in units of the larger deviations that D = 1 makes.

        Nothing is known of them if one of both attractors never repeats.
        """
        basins, problem = self.problem.structure.basins, self.problem
        pair = problem.attractor, problem.structure.attractors[label]
        if not all(attractor.is_fixed for attractor in pair):
            return np.zeros(grid.shape)
        widths = deviations * np.sqrt(np.maximum(*map(self._spread, pair)))
        cells = np.ptp(basins.region.bounds, axis=1) / basins.labels.shape
        reach = np.ceil(np.minimum(widths / cells, basins.labels.shape)).astype(int)
        beyond = ("wrap" if problem.turn else "constant", "constant")
        inner = minimum_filter(basins.labels == label, tuple(2 * reach + 1), mode=beyond)
        held = dataclasses.replace(basins, labels=np.where(inner, label, UNSETTLED))
        covered = grid.covered(lambda states: held.at(problem.on_turn(states)) == label)
        return np.minimum(covered, 1.0 - own)

    def _spread(self, attractor: Attractor) -> Array:
        """The largest variances of x and of v per unit D around an attractor, shape (2,)."""
        variances: Array = np.diagonal(covariances_of(self.problem, attractor), axis1=1, axis2=2)
        return variances.max(axis=0)

    def _core(self, attractor: Attractor, grid: DensityGrid, intensity: float, size: float) -> Array:
        """How much of each cell belongs to a core, whose area 2.5 node spacings as semi-axes show to a few per cent."""
        ellipses = core_of(self.problem, attractor, intensity, size, lambda points: 2.5 * grid.local_spacing(points))
        return grid.covered(lambda states: nearest(states, *ellipses, self.problem.turn) <= 1)
