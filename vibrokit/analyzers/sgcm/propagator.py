"""Propagator: carries ln p on a grid from section to section."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation

from vibrokit.analyzers.sgcm.density_grid import DensityGrid
from vibrokit.errors import SceneError
from vibrokit.kernels.ensemble import carry, run_ensemble
from vibrokit.kernels.log_density import WIDEST, step_rows
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.stopping import COMPLETED
from vibrokit.kernels.vector_field import VectorField
from vibrokit.oscillator import Oscillator
from vibrokit.parts.noise.noise_model import NoiseModel
from vibrokit.progress import advance, stage
from vibrokit.structure.linear_map import linear_map
from vibrokit.symbolic.flow_kind import Flow

_BLOCKS = 8  # of rows; a constant, so that the number of threads changes nothing
_QUINTIC = 3  # nodes that a quintic reaches to each side
# On hertz-0.570 at D = 3e-4 and 200² nodes, with cubics, the mean time to the clear orbit is 2048 periods with 12
# steps, 2063 with 16, 2018 with 24, and 1932 with 8.
_STEPS_PER_RADIAN = 1.5  # of the fastest oscillation or decay: 18 in a forcing period of hertz-0.570
_FEWEST_STEPS = 8
MOST_STEPS = 4096
"""Largest number of steps in a section interval."""
ABSORBED = 1 - 1e-9
"""Share of the probability that a set takes up where it covers a cell."""

Array = NDArray[np.float64]
IsOut = Callable[[Array], NDArray[np.bool_]]

_MIRROR = np.array([1.0, -1.0])  # the reversed flow has −v in place of v
_NO_FLOW = np.empty((0, 0, 2))


@dataclasses.dataclass(frozen=True, eq=False)
class FlowTables:
    """The flow without noise into the nodes of a grid, over each step of a section interval.

    Attributes
    ----------
    grid : DensityGrid
    step : float
        In s.
    steps : int
        In a section interval.
    feet : list of array (nx, nv, 2)
        Where the motion that ends at each node comes from, in node spacings; one array in an autonomous scene.
    growth : list of array (nx, nv)
        ln of the factor by which the flow compresses areas.
    crossed : list of bool array (nx, nv)
        Which of these motions have been at the exit, if position decides.
    amplitude : array (nx, nv)
        a_vv: the noise makes velocities spread by √(a_vv D t).
    """

    grid: DensityGrid
    step: float
    steps: int
    feet: list[Array]
    growth: list[Array]
    crossed: list[NDArray[np.bool_]]
    amplitude: Array

    @classmethod
    def of(
        cls, scene: Oscillator, stepper: Stepper, grid: DensityGrid, steps: int, is_out: IsOut | None = None
    ) -> FlowTables:
        """Integrate backwards in time from all nodes, and forwards again for the derivatives.

        `is_out` tells which states have left, if position decides.
        """
        step = scene.section_interval / steps
        nodes = grid.nodes.reshape(-1, 2)
        tables = cls(grid, step, steps, [], [], [], _amplitude(scene, grid))
        phases = 1 if scene.autonomous else steps
        with stage("flow between nodes", unit="steps", total=phases):
            for phase in range(phases):
                start = phase * step
                mirrored = nodes * _MIRROR
                back = run_ensemble(
                    scene, Flow.STATE_REVERSED, stepper, mirrored, start_time=-(start + step), interval=step
                )  # fmt: skip
                feet = np.where((back.status == COMPLETED)[:, None], back.states * _MIRROR, np.nan)
                places = grid.places(feet)
                inside = ((places >= 0) & (places <= np.array(grid.shape) - 1)).all(axis=1)
                there = linear_map(scene, feet[inside], stepper, start_time=start, interval=step)
                growth = np.zeros(len(nodes))
                with np.errstate(invalid="ignore", divide="ignore"):
                    growth[inside] = -np.log(np.abs(np.linalg.det(there.derivatives)))
                places[~np.isfinite(growth)] = np.nan
                tables.feet.append(places.reshape(*grid.shape, 2))
                tables.growth.append(np.nan_to_num(growth).reshape(grid.shape))
                if is_out is not None:
                    out = is_out(nodes) | is_out(np.nan_to_num(feet))
                    tables.crossed.append(out.reshape(grid.shape))
                advance()
        return tables

    @staticmethod
    def memory(shape: tuple[int, int], phases: int) -> float:
        """Memory that tables take (GiB)."""
        return shape[0] * shape[1] * phases * 4 * 8 / 2**30


def _amplitude(scene: Any, grid: DensityGrid) -> Array:
    """a_vv at the nodes, from q′ = b + a p at the momentum (0, 1)."""
    field, nodes = VectorField(scene), grid.nodes
    kick = np.broadcast_to([0.0, 1.0], nodes.shape)
    still = field.hamiltonian_rate(nodes, np.zeros_like(nodes))[..., 1]
    amplitude: Array = field.hamiltonian_rate(nodes, kick)[..., 1] - still
    return np.maximum(amplitude, 0.0)


@dataclasses.dataclass(frozen=True, eq=False)
class Propagator:
    """Carries φ = ln p over section intervals, by steps of diffusion, flow and diffusion (Strang's splitting).

    Attributes
    ----------
    tables : FlowTables
    intensity : float
        D (m² s⁻³).
    executor : Executor
    """

    tables: FlowTables
    intensity: float
    executor: Executor

    @cached_property
    def _deviation(self) -> Array:
        """Standard deviation of the velocity that noise adds in a step, in node spacings."""
        deviation: Array = np.sqrt(self.tables.amplitude * self.intensity * self.tables.step)
        return deviation / self.tables.grid.v_spacing

    @cached_property
    def _weight(self) -> Array:
        """ln a: with noise that depends on the state, a p diffuses as p does with constant noise (Itô)."""
        if np.ptp(self.tables.amplitude) == 0:
            return np.empty((0, 0))
        return np.log(np.maximum(self.tables.amplitude, 1e-300))

    def interval(self, phi: Array, floor: float, highest: Array | None = None) -> tuple[Array, float]:
        """Return φ one section interval later, and the logarithm of the probability that left by position.

        `highest`, if given, keeps the largest φ at each node over all steps.
        """
        lost, carried = -np.inf, phi
        for phase, carried, rough in self._carried(phi, 0, self.tables.steps, floor):
            if self.tables.crossed:
                out = self.tables.crossed[phase]
                if out.any():
                    lost = np.logaddexp(lost, self.tables.grid.mass(carried, out))
                    carried[out] = np.maximum(carried[out] + np.log(1 - ABSORBED), floor)
                    rough |= binary_dilation(out, iterations=_QUINTIC)
            if highest is not None:
                np.maximum(highest, carried, out=highest)
        return carried, float(lost)

    def over(self, phi: Array, first: int, steps: int, floor: float) -> Array:
        """Return φ some steps later, where `first` is the number of steps since a section."""
        ((_, carried, _),) = deque(self._carried(phi, first, steps, floor), maxlen=1)
        return carried

    def _carried(
        self, phi: Array, first: int, steps: int, floor: float
    ) -> Iterator[tuple[int, Array, NDArray[np.bool_]]]:
        """Yield the phase, φ and where it is rough after each step; the caller may change the arrays in place."""
        phi, rough = self._stepped(phi, np.zeros(phi.shape, dtype=bool), None, 0.5, floor)
        for step in range(first, first + steps):
            phase = step % len(self.tables.feet)
            phi, rough = self._stepped(phi, rough, phase, 1.0 if step < first + steps - 1 else 0.5, floor)
            yield phase, phi, rough

    def _stepped(
        self, phi: Array, rough: NDArray[np.bool_], phase: int | None, time: float, floor: float
    ) -> tuple[Array, NDArray[np.bool_]]:
        """φ after the flow of a phase, if any, and diffusion over `time` steps, in parts that are narrow enough."""
        parts = max(1, int(np.ceil(time * (self._deviation.max() / WIDEST) ** 2)))
        spreads = self._deviation * np.sqrt(time / parts)
        feet, growth = (_NO_FLOW, phi) if phase is None else (self.tables.feet[phase], self.tables.growth[phase])
        given = (phi, rough, feet, growth, self._weight, spreads, parts, floor)
        edges = np.linspace(0, len(phi), _BLOCKS + 1).astype(int).tolist()
        tasks = [(given, first, last) for first, last in itertools.pairwise(edges)]
        blocks = list(carry(_stepped_rows, tasks, self.executor))
        return np.concatenate([out for out, _ in blocks]), np.concatenate([marks for _, marks in blocks])


def _stepped_rows(given: tuple[Any, ...], first: int, last: int) -> tuple[Array, NDArray[np.bool_]]:
    """Some rows of φ after a step, and where they are not smooth; in whatever thread or process."""
    shape = (last - first, given[0].shape[1])
    out, marks = np.empty(shape), np.empty(shape, dtype=bool)
    step_rows(*given, out, marks, first, last)
    return out, marks


def checked_noise(osc: Oscillator) -> NoiseModel:
    """Return the noise; raises SceneError if there is none, or if it has states of its own."""
    if osc.noise is None:
        raise SceneError("the scene has no noise, so a density does not spread; give it a noise model.")
    if osc.noise.extra_states:
        extra = len(osc.noise.extra_states)
        raise SceneError(
            f"the noise has {extra} state{'s' * (extra > 1)} of its own, so that a density needs {2 + extra} "
            f"dimensions: with 100 nodes in each, {100 ** (2 + extra) * 8 / 2**30:.3g} GiB. Densities are computed in "
            "x and v only; use ActionPlot or LeastAction."
        )
    return osc.noise


def steps_for(osc: Oscillator, states: Array) -> int:
    """Return an even number of steps in a section interval that resolves how fast small deviations turn or decay.

    The exact flow treats contacts; a step limits only how long noise acts before it is carried along. So the rate is
    the median over the states, which short contacts do not change.
    """
    rates = np.abs(np.linalg.eigvals(VectorField(osc).jacobian(states))).max(axis=1)
    return max(2 * math.ceil(_STEPS_PER_RADIAN * float(np.median(rates)) * osc.section_interval / 2), _FEWEST_STEPS)
