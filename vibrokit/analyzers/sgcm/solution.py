"""Quasi-stationary densities and committors of an attractor, whose rates differ by what their errors are."""

from __future__ import annotations

import dataclasses
import math
import os
from collections.abc import Generator, Mapping, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import ExitStack
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.problem import ExitProblem
from vibrokit.analyzers.sgcm.committor import Committor, committor
from vibrokit.analyzers.sgcm.cores import Cores, CoreSets
from vibrokit.analyzers.sgcm.density_flow import DensityFlow, check_memory
from vibrokit.analyzers.sgcm.density_grid import DensityGrid, resolved
from vibrokit.analyzers.sgcm.propagator import Propagator
from vibrokit.analyzers.sgcm.quasi_stationary import QuasiStationary, Transition, quasi_stationary
from vibrokit.analyzers.sgcm.sampled_matrix import SampledMatrix
from vibrokit.errors import StructureError
from vibrokit.results.region import Region
from vibrokit.symbolic.flow_kind import Flow

_CONVERGED = 1e-2  # change of ln rate that may be left by iteration
_EXPLORED_TO = 0.1  # the same in exploration
# Relaxations that must pass with all steps, which begin from the density with half of them. On hertz-0.570 at D = 2e-5,
# ln of the rate after 2 differs by 0.004 from that after 4, and its error is 0.03.
_ARRIVED = 2.0
_EVERY = 2  # cells of the basins that are one for the estimate of what their size changes, which is of first order
# A share of what halving the steps changes, as of third order; seen on double wells and hertz-0.570: 1/7 to 1/30. Edges
# of sets that absorb at any time, or that are basins, are of first order, and all of the change counts.
_STEP_ERROR = 1 / 7
_STEEPER = 1.1  # exponent with which depths grow as D falls: above the prefactors' share in hertz-0.570 at D = 1e-5
_BELOW = 12.0  # in ln p: the closer grid keeps what is that far below the density that leaves
_SLACK = 3.0  # more than that, in units of the stronger noise with which it is found
_EXPLORED = 3.0  # node spacings in the narrowest deviation, when the whole region is explored
_NARROWEST = 2.0  # the same on the finest grid, at least
_ENOUGH = 1.05 * _NARROWEST  # and a little to spare
_WANTED = 4.0  # the same on the finest grid, by default
_FEWEST, _MOST = 120, 400  # nodes along each side, by default
_LARGEST = 640  # the same if more than the most are needed for the least width
_EXPLORING = 140  # nodes along each side for exploration, at most
_ZOOMS, _SHRINKING = 4, 0.7  # steps of exploration, each to a region smaller by at least that factor
_MARGIN = 3  # nodes around it
_ALL_FLOWS = 2.6  # memory of all flows together, in units of the one with all steps

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class AtIntensity:
    """The density that has not left an attractor, and how fast it leaves, at one intensity.

    Attributes
    ----------
    intensity : float
    grid : DensityGrid
    found : QuasiStationary
    transition : Transition
    cores : CoreSets
    committors : mapping of int to Committor
        By target.
    step_errors : mapping of int to float
        By target: a share of what halving the steps changes in ln rate; basins are made coarser as well.
    """

    intensity: float
    grid: DensityGrid
    found: QuasiStationary
    transition: Transition
    cores: CoreSets
    committors: Mapping[int, Committor] = dataclasses.field(default_factory=dict)
    step_errors: Mapping[int, float] = dataclasses.field(default_factory=dict)

    @property
    def log_rates(self) -> dict[int, float]:
        """By target: ln of the probability that leaves in one section interval, the mean of density and committor."""
        return {target: 0.5 * (self.found.log_rates[target] + c.log_rate) for target, c in self.committors.items()}

    @property
    def errors(self) -> dict[int, float]:
        """By target: error estimate of ln rate, which is the difference of both, and what steps and iteration add."""
        return {
            target: abs(self.found.log_rates[target] - c.log_rate)
            + self.step_errors[target]
            + self.found.change
            + c.change
            for target, c in self.committors.items()
        }

    @property
    def converged(self) -> bool:
        """Whether all iterations have ended by themselves."""
        return self.found.converged and all(c.converged for c in self.committors.values())

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

    def begun(self, grid: DensityGrid, intensity: float) -> tuple[Array, dict[int, Array]]:
        """Return ln p and, by target, ln of the committor to begin iteration from on another grid, at less noise.

        The shape of −D ln p and of −D ln c depends little on D. Both begin lower than that: what is missing arrives
        sooner than what is too much leaves, which may stay near a saddle for long.
        """
        ratio = (self.intensity / intensity) ** _STEEPER
        committors = {target: grid.resampled(c.log_values, self.grid) * ratio for target, c in self.committors.items()}
        return grid.resampled(self.found.phi, self.grid) * ratio, committors


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
    """

    problem: ExitProblem
    shape: tuple[int, int] | None
    steps: int
    max_memory_gib: float
    samples: int | None = None

    def solve(self, intensities: Sequence[float]) -> Generator[AtIntensity, None, None]:
        """Yield the solutions at some intensities, which must descend.

        Raises StructureError if the nodes are too far apart for the narrowest density, or need too much memory.
        """
        with ExitStack() as stack:
            executor = self.problem.executor or stack.enter_context(ThreadPoolExecutor(os.cpu_count()))
            explored, closer = self.explored(intensities[0], executor)
            grid = self._grid(closer.region, self._shape(closer, intensities[-1]))
            self._check(grid, intensities[-1], _ALL_FLOWS)
            flows = self._flow(grid, self.steps), self._flow(grid, self._half)
            before, at_boundary = explored, self.problem.exit.at_boundary
            share = 1.0 if at_boundary or self.problem.exit.by_position else _STEP_ERROR
            for intensity in intensities:
                start, committors = before.begun(grid, intensity)
                transition, other = (self._transition(flow, intensity, executor) for flow in flows)
                cores = self._cores.on(grid, intensity)
                coarse = self._cores.on(grid, intensity, _EVERY) if at_boundary else cores
                relaxation = self._cores.relaxation
                long = quasi_stationary(other, start, coarse, relaxation, _CONVERGED)
                found = quasi_stationary(transition, long.phi, cores, relaxation, _CONVERGED, _ARRIVED)
                steps = {
                    target: share * abs(rate - long.log_rates[target])
                    for target, rate in found.log_rates.items()
                    if target in long.log_rates
                }
                solved = self._committors(transition, found, cores, committors, _CONVERGED)
                known = {target: solved[target] for target in steps}
                before = AtIntensity(intensity, grid, found, transition, cores, known, steps)
                yield before

    def guide(self, intensity: float, executor: Executor) -> AtIntensity:
        """A solution to guide a simulation by, whose error does not matter: few nodes, and iterated roughly.

        It is one at more noise, on the grid of exploration, if this noise needs too many nodes. All steps are taken:
        with half of them the variance of splitting is 1.8 times as large (double well, ζ = 0.05, depth 26).
        """
        explored, closer = self.explored(intensity, executor)
        grid = self._grid(closer.region, self._nodes(closer, intensity, _ENOUGH, _LARGEST))
        try:
            self._check(grid, intensity, 1.0)
        except StructureError:
            return explored
        start, committors = explored.begun(grid, intensity)
        transition = Propagator(self._flow(grid, self.steps), intensity, executor)
        cores = self._cores.on(grid, intensity)
        found = quasi_stationary(transition, start, cores, self._cores.relaxation, _EXPLORED_TO)
        known = self._committors(transition, found, cores, committors, _EXPLORED_TO)
        return AtIntensity(intensity, grid, found, transition, cores, known) if known else explored

    def explored(self, intensity: float, executor: Executor) -> tuple[AtIntensity, DensityGrid]:
        """The solution on a coarse grid, and a grid around what has probability enough to matter.

        Where the nodes of the whole region are too far apart for the density, a stronger noise is used.
        """
        wanted_shape = self.shape or (_EXPLORING, _EXPLORING)
        shape = min(_EXPLORING, wanted_shape[0]), min(_EXPLORING, wanted_shape[1])
        grid = self._grid(self._cores.region(intensity), shape)
        for _ in range(_ZOOMS):
            stronger = max(intensity, self._cores.resolved(grid, _EXPLORED))
            propagator = Propagator(self._flow(grid, self._half), stronger, executor)
            cores, start = self._cores.on(grid, stronger), self._cores.start(grid, stronger)
            found = quasi_stationary(propagator, start, cores, self._cores.relaxation, _EXPLORED_TO)
            below = (_BELOW * intensity + (_SLACK * stronger if stronger > intensity else 0.0)) / stronger
            wanted = found.highest > min(found.level, found.highest.max()) - below
            if not self.problem.exit.at_boundary:  # cores are needed whole, basins where the density is
                needed = cores if stronger == intensity else self._cores.on(grid, intensity)
                for covered in needed.others.values():
                    wanted |= covered > 0
            if self.problem.exit.by_position:
                wanted |= propagator.flow.beyond_exit(wanted)  # what leaves the grid there is not counted
            closer = self._grid(grid.around(wanted, _MARGIN), shape)
            smaller = closer.areas.sum() * closer.shape[1] < _SHRINKING * grid.areas.sum() * grid.shape[1]
            if stronger == intensity or not smaller:
                break
            grid = closer
        committors = self._committors(propagator, found, cores, {}, _EXPLORED_TO)
        return AtIntensity(stronger, propagator.grid, found, propagator, cores, committors), closer

    def _grid(self, region: Region, shape: tuple[int, int]) -> DensityGrid:
        return DensityGrid.of(self.problem.scene, region, shape, self.problem.exit.faces(self.problem.osc))

    def _shape(self, explored: DensityGrid, intensity: float) -> tuple[int, int]:
        """The nodes that are wanted, or those that the narrowest density needs."""
        if self.shape is not None:
            return self.shape
        fine = self._nodes(explored, intensity, _WANTED, _MOST)
        enough = self._nodes(explored, intensity, _ENOUGH, _LARGEST)
        return max(fine[0], enough[0]), max(fine[1], enough[1])

    def _nodes(self, explored: DensityGrid, intensity: float, spacings: float, most: int) -> tuple[int, int]:
        """Nodes with so many spacings in the narrowest deviation."""
        factor = math.sqrt(self._cores.resolved(explored, spacings) / intensity)
        nx, nv = (max(_FEWEST, min(math.ceil(factor * count), most)) for count in explored.shape)
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
    def _half(self) -> int:
        """Half of the steps, to an even number."""
        return max(2 * (self.steps // 4), 2)

    def _flow(self, grid: DensityGrid, steps: int) -> DensityFlow:
        stepper = self.problem.ensemble_stepper(Flow.STATE_VARIATIONAL)
        beyond = self.problem.beyond if self.problem.exit.by_position else None
        return DensityFlow(self.problem.scene, stepper, grid, steps, beyond)

    def _transition(self, flow: DensityFlow, intensity: float, executor: Executor) -> Transition:
        if self.samples is None:
            return Propagator(flow, intensity, executor)
        scene = flow.scene.replace({"noise.intensity": intensity})
        return SampledMatrix(scene, flow.grid, self.samples, flow.steps, flow.beyond, executor)

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
        earlier, areas, relaxation = transition.backward(found, cores), transition.grid.areas, self._cores.relaxation
        return {
            target: committor(earlier, found, cores, areas, target, relaxation, converged, starts.get(target))
            for target in found.log_rates
        }
