"""Quasi-stationary densities of an attractor on finer and coarser grids, whose differences give the errors."""

from __future__ import annotations

import dataclasses
import itertools
import math
import os
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.problem import ExitProblem
from vibrokit.analyzers.sgcm.cores import around, core, covariances_of, deviations
from vibrokit.analyzers.sgcm.density_grid import DensityGrid, resolved
from vibrokit.analyzers.sgcm.propagator import FlowTables, Propagator
from vibrokit.analyzers.sgcm.quasi_stationary import QuasiStationary, quasi_stationary
from vibrokit.errors import StructureError
from vibrokit.results.region import Region
from vibrokit.symbolic.flow_kind import Flow

_BELOW = 12.0  # in ln p: the closer grid keeps what is that far below the density that leaves
_SLACK = 3.0  # more than that, in units of the stronger noise with which it is found
_EXPLORED = 3.0  # node spacings in the narrowest deviation, when the whole region is explored
_NARROWEST = 2.0  # the same on the finest grid, at least
_COARSER = 0.7  # nodes of the grid for the error estimate, and for exploration, in those of the finest
_ZOOMS, _SHRINKING = 4, 0.7  # steps of exploration, each to a region smaller by at least that factor
_DEVIATIONS = 5.0  # of the density around the orbit that the region covers
_MARGIN = 3  # nodes around it
_WIDER = 0.1  # of the width of the attractors' orbits, on each side of them
_STEP_ERROR = 1 / 3  # Strang's splitting has an error of second order: a third of what doubling the steps changes
_RELAXATION = 10.0  # section intervals in which the density on an attractor without multipliers forgets its start

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class AtIntensity:
    """The density that has not left an attractor, and how fast it leaves, at one intensity.

    Attributes
    ----------
    intensity : float
    grid : DensityGrid
    found : QuasiStationary
        On all nodes.
    errors : mapping of int to float
        By target: error estimate of ln rate, which is what 0.7 times the nodes change and a third of what doubling the
        steps changes.
    """

    intensity: float
    grid: DensityGrid
    found: QuasiStationary
    errors: Mapping[int, float]

    @property
    def log_density(self) -> Array:
        """ln p; NaN where it is not resolved, because it is at the floor."""
        return resolved(self.found.phi)

    @property
    def at_edge(self) -> float:
        """ln of the probability at the outermost nodes."""
        phi = self.found.phi
        outermost = np.ones(phi.shape, dtype=bool)
        outermost[1:-1, 1:-1] = False
        return self.grid.mass(phi, outermost)


@dataclasses.dataclass(frozen=True, eq=False)
class DensitySolver:
    """Solves for densities around one attractor.

    Attributes
    ----------
    problem : ExitProblem
    shape : (int, int)
        Nodes in x and in v.
    steps : int
        In a section interval; even.
    """

    problem: ExitProblem
    shape: tuple[int, int]
    steps: int

    def solve(self, intensities: Sequence[float]) -> Iterator[AtIntensity]:
        """Yield the solutions at some intensities, which must descend.

        Raises StructureError if the nodes are too far apart for the narrowest density.
        """
        with ThreadPoolExecutor(os.cpu_count()) as executor:
            coarse, start = self._explored(intensities[0], executor)
            fine = DensityGrid.of(self.problem.osc, coarse.region, self.shape)
            self._check_resolution(fine, intensities[-1])
            tables = {
                "long": self._tables(coarse, self.steps // 2),
                "coarse": self._tables(coarse, self.steps),
                "fine": self._tables(fine, self.steps),
            }
            for intensity, following in itertools.zip_longest(intensities, intensities[1:]):
                known: dict[str, QuasiStationary] = {}
                for name, table in tables.items():
                    if table.grid.shape != start.shape:
                        start = table.grid.resampled(start, coarse)
                    known[name] = self._found(table, intensity, executor, start)
                    start = known[name].phi
                yield AtIntensity(intensity, fine, known["fine"], _errors(known))
                if following:
                    start = known["coarse"].phi * (intensity / following)

    def _explored(self, intensity: float, executor: Executor) -> tuple[DensityGrid, Array]:
        """A coarse grid around what has probability enough to matter, and ln p on it to start from.

        Where the nodes of the whole region are too far apart for the density, a stronger noise is used: the shape of
        −D ln p depends little on D.
        """
        coarser = (round(_COARSER * self.shape[0]), round(_COARSER * self.shape[1]))
        grid = DensityGrid.of(self.problem.osc, self._region(intensity), coarser)
        steps = max(self.steps // 2, 2)
        for _ in range(_ZOOMS):
            stronger = max(intensity, self._resolved(grid, _EXPLORED))
            found = self._found(self._tables(grid, steps), stronger, executor)
            below = (_BELOW * intensity + (_SLACK * stronger if stronger > intensity else 0.0)) / stronger
            wanted = found.highest > min(found.level, found.highest.max()) - below
            for covered in self._sets(grid, intensity).values():
                wanted |= covered > 0
            closer = DensityGrid.of(self.problem.osc, grid.around(wanted, _MARGIN), coarser)
            start = closer.resampled(found.phi, grid) * (stronger / intensity)
            smaller = closer.areas.sum() * closer.shape[1] < _SHRINKING * grid.areas.sum() * grid.shape[1]
            grid = closer
            if stronger == intensity or not smaller:
                break
        return grid, start

    def _resolved(self, grid: DensityGrid, nodes: float) -> float:
        """The least intensity at which the density around the attractor is wider than some node spacings."""
        attractor = self.problem.attractor
        if not attractor.is_fixed:
            return 0.0
        spacings = grid.local_spacing(attractor.points).max(axis=0)
        return float(((nodes * spacings / deviations(self._covariances[attractor.label])) ** 2).max())

    def _check_resolution(self, grid: DensityGrid, intensity: float) -> None:
        least = self._resolved(grid, _NARROWEST)
        if intensity < least:
            factor = math.sqrt(least / intensity)
            nx, nv = (math.ceil(factor * count) for count in grid.shape)
            raise StructureError(
                f"at D = {intensity:g} the density is narrower than {_NARROWEST:g} node spacings; {grid.shape[0]} × "
                f"{grid.shape[1]} nodes are enough for D = {least:.3g}, and this D needs {nx} × {nv}."
            )

    def _region(self, intensity: float) -> Region:
        """The region of the structure, and the orbits of all attractors at all times with the density around them."""
        structure = self.problem.structure
        orbits = np.concatenate([attractor.orbit[:, :2] for attractor in structure.attractors])
        around_orbits = Region.around(orbits, _WIDER).bounds
        spread = np.diagonal(self._covariances[self.problem.source], axis1=1, axis2=2).max(axis=0)
        beyond = _DEVIATIONS * np.sqrt(intensity * spread)
        low = np.minimum(around_orbits[:, 0], orbits.min(axis=0) - beyond)
        high = np.maximum(around_orbits[:, 1], orbits.max(axis=0) + beyond)
        own = structure.basins.region.bounds
        return Region.of(np.stack([np.minimum(own[:, 0], low), np.maximum(own[:, 1], high)], axis=1))

    def _tables(self, grid: DensityGrid, steps: int) -> FlowTables:
        stepper = self.problem.ensemble_stepper(Flow.STATE_VARIATIONAL)
        is_out = self.problem.is_out if self.problem.exit.by_position else None
        return FlowTables.of(self.problem.scene, stepper, grid, steps, is_out)

    def _found(
        self, tables: FlowTables, intensity: float, executor: Executor, start: Array | None = None
    ) -> QuasiStationary:
        if start is None:
            attractor = self.problem.attractor
            start = around(attractor, self._covariances[attractor.label], intensity, tables.grid)
        propagator = Propagator(tables, intensity, executor)
        return quasi_stationary(propagator, start, self._sets(tables.grid, intensity), self._relaxation)

    def _sets(self, grid: DensityGrid, intensity: float) -> dict[int, Array]:
        """By target: how much of each cell belongs to the core of the attractor."""
        if self.problem.exit.by_position:
            return {}
        others = [a for a in self.problem.structure.attractors if a.label != self.problem.source]
        return {a.label: core(a, self._covariances[a.label], intensity, grid) for a in others}

    @cached_property
    def _covariances(self) -> dict[int, Array]:
        """Around each attractor, by label."""
        return {a.label: covariances_of(self.problem, a) for a in self.problem.structure.attractors}

    @property
    def _relaxation(self) -> float:
        attractor = self.problem.attractor
        largest = float(np.abs(attractor.multipliers).max()) if len(attractor.multipliers) else 0.0
        if not 0.0 < largest < 1.0 or not attractor.is_fixed:
            return _RELAXATION
        return max(1.0, -max(attractor.period, 1) / math.log(largest))


def _errors(known: Mapping[str, QuasiStationary]) -> dict[int, float]:
    """Error estimates of ln rate."""
    fine, coarse, long = (known[name].log_rates for name in ("fine", "coarse", "long"))
    return {
        target: abs(fine[target] - coarse[target])
        + _STEP_ERROR * abs(coarse[target] - long[target])
        + known["fine"].change
        for target in fine
        if target in coarse and target in long
    }
