"""DensitySolver: quasi-stationary densities and committors of an attractor, on two grids."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.problem import ExitProblem
from vibrokit.analyzers.sgcm.at_intensity import AtIntensity
from vibrokit.analyzers.sgcm.cores import Cores, CoreSets
from vibrokit.analyzers.sgcm.density_flow import DensityFlow, check_memory, steps_for
from vibrokit.analyzers.sgcm.density_grid import DensityGrid
from vibrokit.analyzers.sgcm.propagator import Propagator
from vibrokit.analyzers.sgcm.quasi_stationary import (
    Committor,
    Convergence,
    QuasiStationary,
    committors,
    quasi_stationary,
)
from vibrokit.errors import StructureError
from vibrokit.results.region import Region
from vibrokit.symbolic.flow_kind import Flow

COARSER = math.sqrt(2.0)
"""Factor by which nodes are farther apart in a second solution.

What that changes is once an error of second order, and three times one of fourth order.
"""
FEWER = 1.5
"""Factor by which steps are longer in a third solution, at least: they are even."""
_FLOWS = 1.0 + (1.0 + 1.0 / FEWER) / COARSER**2  # memory of all flows in units of the one on the finest grid
ACCURACY = 0.1
"""Relative error of rates, as two stated errors, that 5 node spacings in the narrowest deviation reach.

It is of second order. hertz-0.570, from clear at ΔU/D = 4: 0.43, 0.21, 0.11 and 0.04 with 2.2, 3.2, 5 and 7 spacings,
in 9, 15, 27 and 45 CPU seconds. A double well (ζ = 0.2, ΔU/D = 4 to 12): 0.1 with 2.2 and 0.02 with 5.
"""
_WANTED, _EXPLORED, _NARROWEST = 5.0, 3.0, 2.0  # such spacings: by default, in exploration, and at least
_ENOUGH = 1.05 * _NARROWEST  # and a little to spare
_FEWEST, _MOST, _LARGEST = 120, 400, 640  # nodes along each side, by default; the last one for the least spacings
EDGE = 0.01
"""Of the density that leaves: with less on its edge a region is wide enough."""

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class DensitySolver:
    """Solves for densities around one attractor."""

    problem: ExitProblem
    shape: tuple[int, int] | None = None  # nodes in x and in v; by default as many as the narrowest density needs
    given_steps: int | None = None  # how often noise acts in a section interval; by default as the motion needs
    max_memory_gib: float = 2.0  # that the legs of all flows may take
    accuracy: float = ACCURACY  # relative error of rates that is wanted

    @cached_property
    def steps(self) -> int:
        """How often noise acts in a section interval."""
        orbits = [attractor.orbit[:, :2] for attractor in self.problem.structure.attractors]
        return self.given_steps or steps_for(self.problem.osc, np.concatenate(orbits))

    def solve(self, intensities: Sequence[float], refused: dict[float, str]) -> Iterator[AtIntensity]:
        """Yield what is found at some intensities, which must descend, and add to `refused` why others are left out.

        One is if the nodes are too far apart for its density, or need too much memory. Each of the others is solved
        on a coarser grid and from there on the finest one. What fewer steps and other sets change of the committors is
        found on the coarser grid.
        """
        before, closer = self.explored(intensities[0])
        grid, left = None, list(intensities)
        while left and grid is None:
            grid = self._grid(closer.region, self._shape(closer, left[-1]))
            try:
                self._check(grid, left[-1], _FLOWS)
            except StructureError as error:
                refused[left.pop()] = str(error)
                grid = None
        if grid is None:
            return
        nx, nv = (math.ceil(count / COARSER) for count in grid.shape)
        flow = self._flow(grid, self.steps)
        coarse = self._flow(self._grid(closer.region, (nx, nv)), self.steps)
        rough = dataclasses.replace(coarse, steps=self._fewer)
        # On hertz-0.570 at D = 2e-5, ln of the rate after 2 relaxations from the coarser solution differs by 0.004 from
        # that after 4, and its error is 0.03.
        settled = dataclasses.replace(self._convergence, crossed=2.0)
        for intensity in left:
            coarser = self._solved(coarse, before, intensity, settled)
            propagator = Propagator(rough, intensity, self.problem.executor)
            edges, cores = self._other_edges(coarser), self._larger_cores(coarser)
            before = dataclasses.replace(
                self._solved(flow, coarser, intensity, settled),
                coarser=coarser,
                fewer_steps=self._again(coarser, dataclasses.replace(coarser.density, propagator=propagator)),
                other_edges=None if edges is None else self._again(coarser, coarser.density.among(edges)),
                larger_cores=None if cores is None else self._again(coarser, coarser.density.among(cores)),
            )
            yield before

    def guide(self, intensity: float) -> AtIntensity:
        """Return a rough solution to guide a simulation by, at more noise if this noise needs too many nodes.

        All steps are taken: with half of them the variance of splitting is 1.8 times as large (double well, ζ = 0.05,
        depth 26).
        """
        explored, closer = self.explored(intensity)
        grid = self._grid(closer.region, self._nodes(closer, intensity, _ENOUGH, _FEWEST, _LARGEST))
        try:
            self._check(grid, intensity, 1.0)
        except StructureError:
            return explored
        found = self._solved(self._flow(grid, self.steps), explored, intensity, self._exploring)
        return found if found.committors else explored

    def explored(self, intensity: float) -> tuple[AtIntensity, DensityGrid]:
        """The solution on a coarse grid, and a grid around what has probability enough to matter.

        Where the nodes of the whole region are too far apart for the density, a stronger noise is used, and again on a
        smaller region, as long as that has 0.7 times the area or less.
        """
        nx, nv = self.shape or (_LARGEST, _LARGEST)
        shape = min(nx, 140), min(nv, 140)
        grid = self._grid(self._cores.region(intensity), shape)
        for _ in range(4):
            stronger = max(intensity, self._cores.resolved(grid, _EXPLORED))
            propagator = Propagator(self._flow(grid, self._fewer), stronger, self.problem.executor)
            # States are committed as near to the edges of basins as at the noise that is wanted.
            cores = self._cores.on(grid, stronger, nearer=math.sqrt(stronger / intensity))
            found = quasi_stationary(propagator, self._cores.start(grid, stronger), cores, self._exploring)
            wanted = self._wanted(found, intensity)
            closer = self._grid(grid.around(wanted, 3), shape)
            smaller = closer.areas.sum() * closer.shape[1] < 0.7 * grid.areas.sum() * grid.shape[1]
            wider = self._widened(found, intensity / stronger)
            if stronger > intensity and smaller:
                grid = closer
            elif wider is not None:
                grid = self._grid(wider, shape)
            else:
                break
        return AtIntensity(found, committors(found, self._exploring)), closer

    def _wanted(self, found: QuasiStationary, intensity: float) -> NDArray[np.bool_]:
        """The nodes that matter at an intensity, by a density at this or more noise.

        They hold the density down to 12 below what leaves in ln ρ, and 3 more in units of a stronger noise, and the
        cores of other attractors; basins count only where the density is.
        """
        stronger = found.propagator.intensity
        below = (12.0 * intensity + (3.0 * stronger if stronger > intensity else 0.0)) / stronger
        wanted: NDArray[np.bool_] = found.highest > found.top - below
        if not self.problem.exit.at_boundary:
            for covered in self._cores.on(found.grid, intensity, nearer=0.0).others.values():
                wanted |= (covered > 0) & (found.cores.committed == 0)
        if self.problem.outlet is not None:
            wanted |= found.propagator.flow.beyond_exit(wanted)  # what leaves the grid there is not counted
        return wanted

    def _widened(self, found: QuasiStationary, weaker: float) -> Region | None:
        """A region wider on the sides where motion that would come back leaves the grid; None if there is none.

        `weaker` is the noise that is wanted over that of the density: depths grow as it falls.
        """
        matters, grid = found.highest > found.top + weaker * math.log(EDGE), found.grid
        sides = np.array([[matters[0].any(), matters[-1].any()], [matters[:, 0].any(), matters[:, -1].any()]])
        if grid.turn:
            sides[0] = False
        if self.problem.outlet is not None or not sides.any():
            return None
        bounds = np.array([grid.region.x, grid.region.v])
        return Region.of(bounds + 0.25 * np.diff(bounds) * sides * [-1.0, 1.0])

    def _solved(
        self, flow: DensityFlow, before: AtIntensity, intensity: float, convergence: Convergence
    ) -> AtIntensity:
        """The density and the committors on the grid of a flow, begun from those of another one."""
        start, known = before.begun(flow.grid, intensity)
        propagator, cores = Propagator(flow, intensity, self.problem.executor), self._cores.on(flow.grid, intensity)
        found = quasi_stationary(propagator, start, cores, convergence)
        return AtIntensity(found, committors(found, dataclasses.replace(convergence, crossed=4.0), known))

    def _again(self, known: AtIntensity, density: QuasiStationary) -> dict[int, Committor]:
        """The committors of a density with another propagator or other cores, begun from the known ones."""
        starts = {target: each.log_values for target, each in known.committors.items()}
        return committors(density, self._convergence, starts)

    def _other_edges(self, known: AtIntensity) -> CoreSets | None:
        """Sets that absorb √2 times nearer to the edges of basins, or the basins of cells twice as large."""
        if not known.density.cores.committed.any():
            return None
        every, nearer = (2, 1.0) if self.problem.exit.at_boundary else (1, COARSER)
        sets = self._cores.on(known.grid, known.intensity, every, nearer=nearer)
        return dataclasses.replace(sets, own=known.density.cores.own)

    def _larger_cores(self, known: AtIntensity) -> CoreSets | None:
        """Cores 1.5 times as large, to see whether limits of weak noise depend on their size."""
        if self.problem.exit.at_boundary or not known.density.cores.others:
            return None
        return self._cores.on(known.grid, known.intensity, larger=1.5)

    def _grid(self, region: Region, shape: tuple[int, int]) -> DensityGrid:
        return DensityGrid.of(self.problem.scene, region, shape, self.problem.faces, self.problem.turn)

    def _shape(self, explored: DensityGrid, intensity: float) -> tuple[int, int]:
        """The nodes that are wanted, or those that the narrowest density needs."""
        if self.shape is not None:
            return self.shape
        finer = math.sqrt(ACCURACY / self.accuracy)
        least = math.ceil(min(1.0, finer) * _FEWEST)
        fine = self._nodes(explored, intensity, finer * _WANTED, least, _MOST)
        enough = self._nodes(explored, intensity, _ENOUGH, least, _LARGEST)
        return max(fine[0], enough[0]), max(fine[1], enough[1])

    def _nodes(
        self, explored: DensityGrid, intensity: float, spacings: float, least: int, most: int
    ) -> tuple[int, int]:
        """Nodes with so many spacings in the narrowest deviation."""
        factor = math.sqrt(self._cores.resolved(explored, spacings) / intensity)
        nx, nv = (max(least, min(math.ceil(factor * count), most)) for count in explored.shape)
        return nx, nv

    def _check(self, grid: DensityGrid, intensity: float, flows: float) -> None:
        """Raise StructureError if the nodes are too far apart, or the legs of so many flows need too much memory."""
        least = self._cores.resolved(grid, _NARROWEST)
        if intensity < least:
            factor = math.sqrt(least / intensity)
            nx, nv = (math.ceil(factor * count) for count in grid.shape)
            raise StructureError(
                f"at D = {intensity:g} the density is narrower than {_NARROWEST:g} node spacings; {grid.shape[0]} × "
                f"{grid.shape[1]} nodes are enough for D = {least:.5g}, and this D needs {nx} × {nv}. "
                "LeastAction gives the energy in the limit of weak noise."
            )
        check_memory(self.problem.scene, grid.shape, self.steps, self.max_memory_gib, flows)

    @cached_property
    def _cores(self) -> Cores:
        return Cores(self.problem)

    @cached_property
    def _convergence(self) -> Convergence:
        return Convergence(self._cores.relaxation, 1e-2)

    @cached_property
    def _exploring(self) -> Convergence:
        return Convergence(self._cores.relaxation, 0.1)

    @property
    def _fewer(self) -> int:
        """Two thirds of the steps, or a little less, to an even number."""
        return max(2 * math.floor(self.steps / (2 * FEWER)), 2)

    def _flow(self, grid: DensityGrid, steps: int) -> DensityFlow:
        stepper = self.problem.ensemble_stepper(Flow.STATE_VARIATIONAL)
        beyond = None if self.problem.outlet is None else self.problem.beyond
        return DensityFlow(self.problem.scene, stepper, grid, steps, beyond)
