"""DensitySolver: quasi-stationary densities and committors of an attractor, on two grids."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Generator, Mapping, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.problem import ExitProblem
from vibrokit.analyzers.sgcm.at_intensity import COARSER, FEWER, LARGER, NEARER, AtIntensity, Unresolved
from vibrokit.analyzers.sgcm.committor import Committor, committor
from vibrokit.analyzers.sgcm.cores import Cores, CoreSets
from vibrokit.analyzers.sgcm.density_flow import DensityFlow, check_memory
from vibrokit.analyzers.sgcm.density_grid import DensityGrid
from vibrokit.analyzers.sgcm.propagator import Propagator
from vibrokit.analyzers.sgcm.quasi_stationary import QuasiStationary, Transition, quasi_stationary
from vibrokit.analyzers.sgcm.sampled_matrix import SampledMatrix
from vibrokit.errors import StructureError
from vibrokit.results.basins import ESCAPED
from vibrokit.results.region import Region
from vibrokit.symbolic.flow_kind import Flow

_CONVERGED = 1e-2  # change of ln rate that may be left by iteration
_EXPLORED_TO = 0.1  # the same in exploration
# Relaxations that must pass from a density that is solved with fewer steps or nodes. On hertz-0.570 at D = 2e-5, ln of
# the rate after 2 differs by 0.004 from that after 4, and its error is 0.03.
_ARRIVED = 2.0
_EVERY = 2  # cells of the basins that are one for the estimate of what their size changes, which is of first order
_BELOW = 12.0  # in ln p: the closer grid keeps what is that far below the density that leaves
_SLACK = 3.0  # more than that, in units of the stronger noise with which it is found
_EXPLORED = 3.0  # node spacings in the narrowest deviation, when the whole region is explored
_NARROWEST = 2.0  # the same on the finest grid, at least
_ENOUGH = 1.05 * _NARROWEST  # and a little to spare
_WANTED = 5.0  # the same on the finest grid, by default
# Relative error of rates, as two stated errors, that so many spacings reach; it is of second order. hertz-0.570, from
# clear at ΔU/D = 4: 0.43, 0.21, 0.11 and 0.04 with 2.2, 3.2, 5 and 7 spacings, in 9, 15, 27 and 45 CPU seconds. A
# double well (ζ = 0.2, ΔU/D = 4 to 12): 0.1 with 2.2 and 0.02 with 5.
ACCURACY = 0.1
_FEWEST, _MOST = 120, 400  # nodes along each side, by default
_LARGEST = 640  # the same if more than the most are needed for the least width
_EXPLORING = 140  # nodes along each side for exploration, at most
_ZOOMS, _SHRINKING = 4, 0.7  # steps of exploration, each to a region smaller by at least that factor
_MARGIN = 3  # nodes around it
_EDGE = 0.01  # of the density that leaves: with less on its edge the region is wide enough
_GROWN = 0.25  # of the width, by which a region grows on a side where it is too narrow
_ALL_FLOWS = 3.7  # memory of all flows together, in units of the one with all steps on the finest grid

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class DensitySolver:
    """Solves for densities around one attractor.

    Attributes
    ----------
    problem : ExitProblem
    shape : (int, int) or None
        Nodes in x and in v; by default as many as the narrowest density needs.
    steps : int
        How often noise acts in a section interval; even.
    max_memory_gib : float
        Memory that the legs of all flows may take (GiB).
    samples : int or None
        If given, transitions are those of so many simulated trajectories from each cell.
    accuracy : float
        Relative error of rates that is wanted.
    """

    problem: ExitProblem
    shape: tuple[int, int] | None
    steps: int
    max_memory_gib: float
    samples: int | None = None
    accuracy: float = ACCURACY

    def solve(self, intensities: Sequence[float]) -> Generator[AtIntensity | Unresolved, None, None]:
        """Yield what is found at some intensities, which must descend; first those that cannot be resolved.

        One cannot if the nodes are too far apart for its density, or need too much memory. Each of the others is solved
        on a coarser grid and from there on the finest one. What fewer steps and other sets change of the committors is
        found on the coarser grid.
        """
        explored, closer = self.explored(intensities[0])
        grid, left = None, list(intensities)
        while left and grid is None:
            grid = self._grid(closer.region, self._shape(closer, left[-1]))
            try:
                self._check(grid, left[-1], _ALL_FLOWS)
            except StructureError as error:
                yield Unresolved(left.pop(), str(error))
                grid = None
        if grid is None:
            return
        nx, nv = (math.ceil(count / COARSER) for count in grid.shape)
        flow = self._flow(grid, self.steps)
        coarse = self._flow(self._grid(closer.region, (nx, nv)), self.steps)
        rough = dataclasses.replace(coarse, steps=self._fewer)
        before = explored
        for intensity in left:
            coarser = self._solved(coarse, before, intensity)
            before = dataclasses.replace(
                self._solved(flow, coarser, intensity),
                coarser=coarser,
                fewer_steps=self._with(coarser, self._transition(rough, intensity), coarser.cores),
                other_sets=self._with(coarser, coarser.transition, self._other_sets(coarser))
                if coarser.cores.others
                else {},
                nearer=self._with(coarser, coarser.transition, self._nearer(coarser))
                if coarser.cores.committed.any() and not self.problem.exit.at_boundary
                else None,
            )
            yield before

    def _with(self, known: AtIntensity, transition: Transition, cores: CoreSets) -> dict[int, Committor]:
        """The committors of a density as it is, with another transition or other cores."""
        density = known.found
        if cores.own is not known.cores.own:
            with np.errstate(divide="ignore"):
                density = dataclasses.replace(density, in_core=density.phi + np.log(cores.own * known.grid.areas))
        starts = {target: each.log_values for target, each in known.committors.items()}
        return self._committors(transition, density, cores, starts, _CONVERGED)

    def _other_sets(self, known: AtIntensity) -> CoreSets:
        """Larger cores, or coarser basins."""
        if not self.problem.exit.at_boundary:
            return self._cores.on(known.grid, known.intensity, larger=LARGER)
        coarser = self._cores.on(known.grid, known.intensity, _EVERY)
        return dataclasses.replace(coarser, own=known.cores.own)

    def _nearer(self, known: AtIntensity) -> CoreSets:
        """Sets that absorb nearer to the edges of the basins."""
        return self._cores.on(known.grid, known.intensity, nearer=NEARER)

    def _solved(self, flow: DensityFlow, before: AtIntensity, intensity: float) -> AtIntensity:
        """The density and the committors on the grid of a flow, begun from those of another one."""
        transition, cores = self._transition(flow, intensity), self._cores.on(flow.grid, intensity)
        begun, committors = before.begun(flow.grid, intensity)
        found = quasi_stationary(transition, begun, cores, self._cores.relaxation, _CONVERGED, _ARRIVED)
        known = self._committors(transition, found, cores, committors, _CONVERGED)
        resolved = not self.problem.exit.at_boundary
        return AtIntensity(intensity, flow.grid, found, transition, cores, known, sets_resolved=resolved)

    def guide(self, intensity: float) -> AtIntensity:
        """A solution to guide a simulation by, whose error does not matter: few nodes, and iterated roughly.

        It is one at more noise, on the grid of exploration, if this noise needs too many nodes. All steps are taken:
        with half of them the variance of splitting is 1.8 times as large (double well, ζ = 0.05, depth 26).
        """
        explored, closer = self.explored(intensity)
        grid = self._grid(closer.region, self._nodes(closer, intensity, _ENOUGH, _FEWEST, _LARGEST))
        try:
            self._check(grid, intensity, 1.0)
        except StructureError:
            return explored
        start, committors = explored.begun(grid, intensity)
        transition = Propagator(self._flow(grid, self.steps), intensity, self.problem.executor)
        cores = self._cores.on(grid, intensity)
        found = quasi_stationary(transition, start, cores, self._cores.relaxation, _EXPLORED_TO)
        known = self._committors(transition, found, cores, committors, _EXPLORED_TO)
        return AtIntensity(intensity, grid, found, transition, cores, known) if known else explored

    def explored(self, intensity: float) -> tuple[AtIntensity, DensityGrid]:
        """The solution on a coarse grid, and a grid around what has probability enough to matter.

        Where the nodes of the whole region are too far apart for the density, a stronger noise is used.
        """
        wanted_shape = self.shape or (_EXPLORING, _EXPLORING)
        shape = min(_EXPLORING, wanted_shape[0]), min(_EXPLORING, wanted_shape[1])
        grid = self._grid(self._cores.region(intensity), shape)
        for _ in range(_ZOOMS):
            stronger = max(intensity, self._cores.resolved(grid, _EXPLORED))
            propagator = Propagator(self._flow(grid, self._fewer), stronger, self.problem.executor)
            nearer = math.sqrt(stronger / intensity)  # as near as at the noise that is wanted
            cores = self._cores.on(grid, stronger, nearer=nearer)
            start = self._cores.start(grid, stronger)
            found = quasi_stationary(propagator, start, cores, self._cores.relaxation, _EXPLORED_TO)
            below = (_BELOW * intensity + (_SLACK * stronger if stronger > intensity else 0.0)) / stronger
            wanted = found.highest > min(found.level, found.highest.max()) - below
            if not self.problem.exit.at_boundary:  # cores are needed whole, basins where the density is
                for covered in self._cores.on(grid, intensity, nearer=0.0).others.values():
                    wanted |= (covered > 0) & (cores.committed == 0)
            if self.problem.outlet is not None:
                wanted |= propagator.flow.beyond_exit(wanted)  # what leaves the grid there is not counted
            closer = self._grid(grid.around(wanted, _MARGIN), shape)
            smaller = closer.areas.sum() * closer.shape[1] < _SHRINKING * grid.areas.sum() * grid.shape[1]
            wider = self._widened(grid, found, intensity / stronger)
            if stronger > intensity and smaller:
                grid = closer
            elif wider is not None:
                grid = self._grid(wider, shape)
            else:
                break
        committors = self._committors(propagator, found, cores, {}, _EXPLORED_TO)
        return AtIntensity(stronger, propagator.grid, found, propagator, cores, committors), closer

    def _widened(self, grid: DensityGrid, found: QuasiStationary, weaker: float) -> Region | None:
        """A region wider on the sides where motion between attractors leaves the grid; None if there is no such side.

        What leaves there is lost, although it would come back. Where motion escapes or position decides it is not.
        `weaker` is the noise that is wanted over that of the density: depths grow as it falls.
        """
        matters = found.highest > min(found.level, found.highest.max()) + weaker * math.log(_EDGE)
        sides = np.array([[matters[0].any(), matters[-1].any()], [matters[:, 0].any(), matters[:, -1].any()]])
        if grid.turn:
            sides[0] = False
        if self.problem.outlet is not None or not sides.any():
            return None
        bounds = np.array([grid.region.x, grid.region.v])
        return Region.of(bounds + _GROWN * np.diff(bounds) * sides * [-1.0, 1.0])

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
        needed = flows * DensityFlow.memory(grid.shape, self.steps, self.problem.scene.autonomous)
        check_memory(grid.shape, needed, self.steps, self.max_memory_gib)

    @cached_property
    def _cores(self) -> Cores:
        return Cores(self.problem)

    @property
    def _fewer(self) -> int:
        """Two thirds of the steps, or a little less, to an even number."""
        return max(2 * math.floor(self.steps / (2 * FEWER)), 2)

    def _flow(self, grid: DensityGrid, steps: int) -> DensityFlow:
        stepper = self.problem.ensemble_stepper(Flow.STATE_VARIATIONAL)
        beyond = None if self.problem.outlet is None else self.problem.beyond
        escaping = self.problem.outlet == ESCAPED  # may take motion far beyond the grid in a leg
        return DensityFlow(self.problem.scene, stepper, grid, steps, beyond, watches_edge=escaping)

    def _transition(self, flow: DensityFlow, intensity: float) -> Transition:
        if self.samples is None:
            return Propagator(flow, intensity, self.problem.executor)
        scene = flow.scene.replace({"noise.intensity": intensity})
        return SampledMatrix(scene, flow.grid, self.samples, flow.steps, flow.beyond, self.problem.executor)

    def _committors(
        self,
        transition: Transition,
        found: QuasiStationary,
        cores: CoreSets,
        starts: Mapping[int, Array],
        converged: float,
    ) -> dict[int, Committor]:
        """The committor of each target whose rate is known."""
        if not found.log_rates:
            return {}
        earlier, relaxation = transition.backward(found, cores), self._cores.relaxation
        return {
            target: committor(earlier, found, cores, target, relaxation, converged, starts.get(target))
            for target in found.log_rates
        }
