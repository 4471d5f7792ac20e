"""SampledMatrix: the transition over one section interval as published, from simulated trajectories."""

from __future__ import annotations

import dataclasses
import math
from concurrent.futures import Executor
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from vibrokit.analyzers.sgcm.cores import CoreSets
from vibrokit.analyzers.sgcm.density_flow import Beyond
from vibrokit.analyzers.sgcm.density_grid import DensityGrid
from vibrokit.analyzers.sgcm.quasi_stationary import Backward, QuasiStationary
from vibrokit.kernels.choice import ensemble_stepper
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.stopping import COMPLETED
from vibrokit.kernels.streams import streams_of
from vibrokit.oscillator import Oscillator
from vibrokit.progress import TRAJECTORIES, stage
from vibrokit.symbolic.flow_kind import Flow

_AT_ONCE = 1_000_000  # trajectories
_CHECKS = 32  # exit tests in a section interval, if position decides

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class SampledMatrix:
    """Stochastic generalized cell mapping: the share of trajectories from each cell that arrive in each other cell.

    The cell of a node is what is nearer to it than to others. A transition less likely than one in `samples` is not
    seen, so that a density below that has no meaning; a density spreads by half a cell in each interval.

    Attributes
    ----------
    scene : Oscillator
        With the noise intensity in question.
    grid : DensityGrid
    samples : int
        Trajectories from each cell.
    seed : int
    beyond : callable or None
        How far states are beyond the exit, if position decides.
    executor : Executor, optional
    """

    scene: Oscillator
    grid: DensityGrid
    samples: int
    seed: int
    beyond: Beyond | None
    executor: Executor | None

    def interval(self, phi: Array, floor: float, highest: Array | None = None) -> tuple[Array, float]:
        """Return φ one section interval later, and the logarithm of the probability that left by position."""
        stays, leaves = self._matrix
        top = float(phi.max())
        mass = np.where(phi > floor, np.exp(phi - top), 0.0) * self.grid.areas
        with np.errstate(divide="ignore"):
            carried = np.log((stays @ mass.ravel()).reshape(self.grid.shape) / self.grid.areas) + top
            lost = np.log(leaves @ mass.ravel()) + top
        carried = np.maximum(carried, floor)
        if highest is not None:
            np.maximum(highest, carried, out=highest)
        return carried, float(lost)

    def backward(self, density: QuasiStationary, cores: CoreSets) -> Backward:
        """Return what gives ln of an expected value one section interval earlier."""
        stays, leaves = self._matrix
        transposed = stays.T.tocsr()

        def earlier(values: Array, floor: float, at_exit: float) -> Array:
            expected = transposed @ np.exp(values).ravel() + math.exp(at_exit) * leaves
            with np.errstate(divide="ignore"):
                found: Array = np.maximum(np.log(expected.reshape(self.grid.shape)), floor)
            return found

        return earlier

    @cached_property
    def _matrix(self) -> tuple[csr_array, Array]:
        """Probabilities (to, from) between nodes, and of leaving by position from each."""
        nodes = self.grid.nodes.reshape(-1, 2)
        count, at_once = len(nodes), max(1, _AT_ONCE // self.samples)
        random = np.random.default_rng(self.seed)
        widths = self.grid.local_spacing(nodes)
        places, leaves = csr_array((count, count)), np.zeros(count)
        with stage("transitions", unit=TRAJECTORIES, total=count * self.samples):
            for first in range(0, count, at_once):
                cells = np.repeat(np.arange(first, min(first + at_once, count)), self.samples)
                starts = nodes[cells] + (random.random((len(cells), 2)) - 0.5) * widths[cells]
                ends, out = self._carried(starts, first * self.samples)
                to = np.rint(np.nan_to_num(self.grid.places(ends), nan=-1.0)).astype(int)
                inside = ((to >= 0) & (to < self.grid.shape)).all(axis=1) & ~out
                reached = to[inside, 0] * self.grid.shape[1] + to[inside, 1]
                shares = np.full(len(reached), 1.0 / self.samples)
                places = places + csr_array((shares, (reached, cells[inside])), shape=(count, count))
                leaves += np.bincount(cells[out], minlength=count) / self.samples
        return places, leaves

    def _carried(self, starts: Array, first: int) -> tuple[Array, NDArray[np.bool_]]:
        """States one section interval later, and which have been at the exit."""
        stepper = ensemble_stepper(self.scene, Flow.NOISY)
        checks = 1 if self.beyond is None else _CHECKS
        interval = self.scene.section_interval / checks
        states, out = starts, np.zeros(len(starts), dtype=bool)
        streams = streams_of(self.seed, np.arange(first, first + len(starts)))
        for number in range(checks):
            ended = run_ensemble(
                self.scene, Flow.NOISY, stepper, states, start_time=number * interval, interval=interval,
                streams=streams, executor=self.executor,
            )  # fmt: skip
            gone = ended.status != COMPLETED  # at a pole, for instance
            states, streams = np.where(gone[:, None], np.nan, ended.states), ended.streams
            if self.beyond is not None:
                out |= gone | (self.beyond(states) >= 0)
        return states, out
