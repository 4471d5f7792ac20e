"""Propagator: carries ln ρ on a grid from section to section, and expected values back."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.sgcm.density_flow import ABSORBED, DensityFlow, Leg
from vibrokit.analyzers.sgcm.density_grid import DensityGrid
from vibrokit.errors import SceneError, counted
from vibrokit.kernels.log_density import mark_rows, parts_of, step_rows
from vibrokit.kernels.tasks import carry
from vibrokit.oscillator import Oscillator
from vibrokit.parts.noise import NoiseModel
from vibrokit.progress import current

Array = NDArray[np.float64]
Marks = NDArray[np.uint8]

_NO_WEIGHT = np.empty((0, 0))


@dataclasses.dataclass(frozen=True, eq=False)
class Propagator:
    """Carries φ = ln ρ over section intervals, by turns along the exact flow and by diffusion."""

    flow: DensityFlow
    intensity: float  # D (m² s⁻³)
    executor: Executor | None

    @property
    def grid(self) -> DensityGrid:
        """The nodes."""
        return self.flow.grid

    @cached_property
    def deviation(self) -> Array:
        """Standard deviation of the velocity that noise adds in a unit of time, in node spacings."""
        deviation: Array = np.sqrt(self.flow.amplitude * self.intensity) / self.grid.v_spacing
        return deviation

    @cached_property
    def _weight(self) -> Array:
        """ln a: with noise that depends on the state, a ρ diffuses as ρ does with constant noise (Itô)."""
        if np.ptp(self.flow.amplitude) == 0:
            return _NO_WEIGHT
        return np.log(np.maximum(self.flow.amplitude, 1e-300))

    def interval(self, phi: Array, floor: float, highest: Array | None = None) -> tuple[Array, float]:
        """Return φ one section interval later, and the logarithm of the probability that left by position.

        `highest`, if given, keeps the largest φ at each node over all legs.
        """
        lost, before, carried = -np.inf, phi, phi
        for leg, carried, taken in self._carried(self.flow.legs, phi, self._weight, floor):
            lost = np.logaddexp(lost, taken)
            if self.flow.beyond is not None and leg.leaving.any():
                passing = leg.leaving > 0
                lost = np.logaddexp(lost, self.grid.mass(before + np.log(np.where(passing, leg.leaving, 1.0)), passing))
            before = carried
            if highest is not None:
                np.maximum(highest, carried, out=highest)
        return carried, float(lost)

    def along(self, legs: Sequence[Leg], phi: Array, floor: float) -> tuple[Array, float]:
        """Return φ after some legs, and ln of the factor by which truncation had changed its probability.

        That factor is divided out after each leg, so that probability is kept, except for what leaves the grid.
        """
        mass, factor, before = self.grid.mass(phi), 0.0, phi
        for leg, carried, _ in self._carried(legs, phi, self._weight, floor):
            if leg.leaving.any():
                mass += math.log1p(-min(math.exp(self.grid.mass(before, leg.leaving > 0) - mass), ABSORBED))
            change = self.grid.mass(carried) - mass
            kept = carried > floor
            carried[kept] -= change
            factor, before = factor + change, carried.copy()
        return before, factor

    def backward_legs(self, phi: Array, least: float, kept: Sequence[Array]) -> list[Leg]:
        """Return the legs that carry an expected value back, the last one first, at the nodes that matter.

        That is where ln ρ, which is `phi` on the section, exceeds `least` at its time, and in the cells of some cores.
        Elsewhere nothing is computed.
        """
        reached = [phi, *(later for _, later, _ in self._carried(self.flow.legs, phi, self._weight, least))]
        there = [one > least for one in reached[:-1]]
        for covered in kept:
            there[0] |= covered > 0
        return [
            dataclasses.replace(leg, feet=np.where(mask[..., None], leg.feet, np.nan))
            for leg, mask in zip(self.flow.backward_legs, reversed(there), strict=True)
        ]

    def earlier(self, legs: Sequence[Leg], values: Array, floor: float, at_exit: float) -> Iterator[Array]:
        """Yield ln of an expected value before each of some backward legs; `at_exit` is that of motion at the exit."""
        for _, found, _ in self._carried(legs, values, _NO_WEIGHT, floor, at_exit):
            yield found

    def _carried(
        self, legs: Sequence[Leg], phi: Array, weight: Array, floor: float, at_exit: float = -math.inf
    ) -> Iterator[tuple[Leg, Array, float]]:
        """Yield each leg, φ after it, which may be changed in place, and ln of the probability taken up at the exit."""
        marks = np.empty(phi.shape, dtype=np.uint8)
        mark_rows(phi, floor, marks)
        for leg in legs:
            phi, marks, taken = self._stepped(phi, marks, leg, at_exit, weight, floor)
            yield leg, phi, taken

    def _stepped(
        self, phi: Array, marks: Marks, leg: Leg, at_exit: float, weight: Array, floor: float
    ) -> tuple[Array, Marks, float]:
        """φ after the flow, the exit and diffusion in narrow parts, its marks, and ln of what the exit takes up."""
        spread = math.sqrt(leg.noise)
        parts = parts_of(float(self.deviation.max()) * spread)
        spreads = self.deviation * (spread / math.sqrt(max(parts, 1)))
        given = (phi, marks, leg.feet, leg.growth, leg.crossed, at_exit, weight, spreads, parts, floor)
        edges = np.linspace(0, len(phi), 5).astype(int).tolist()  # four tasks for threads or processes
        tasks = [(given, first, last) for first, last in itertools.pairwise(edges)]
        blocks = list(carry(_stepped_rows, tasks, self.executor))
        out, marks, taken = (np.concatenate(some) for some in zip(*blocks, strict=True))
        return out, marks, float(np.logaddexp.reduce(taken + np.log(self.grid.areas[:, 0])))


def _stepped_rows(given: tuple[Any, ...], first: int, last: int) -> tuple[Array, Marks, Array]:
    """Some rows of φ after a step, their marks, and what the exit takes up; in whatever thread or process."""
    shape = (last - first, given[0].shape[1])
    out, marks, taken = np.empty(shape), np.empty(shape, dtype=np.uint8), np.empty(last - first)
    rows = max(1, 16_384 // shape[1])  # between looks at the time limit: a node takes 1 to 10 µs
    for begin in range(first, last, rows):
        end = min(begin + rows, last)
        part = slice(begin - first, end - first)
        step_rows(*given, out[part], marks[part], taken[part], begin, end)
        current().check()
    return out, marks, taken


def checked_noise(osc: Oscillator, needs_intensity: bool = True) -> NoiseModel:
    """Return the noise; raises SceneError if there is none, if its D is 0, or if it has states of its own."""
    if osc.noise is None or (needs_intensity and not osc.noise.intensity > 0):
        raise SceneError("the scene has no noise, so a density does not spread; give it a noise model with D > 0.")
    if osc.noise.extra_states:
        extra = len(osc.noise.extra_states)
        raise SceneError(
            f"the noise has {counted(extra, 'state')} of its own, so that a density needs {2 + extra} "
            f"dimensions: with 100 nodes in each, {100 ** (2 + extra) * 8 / 2**30:.3g} GiB. Densities are computed in "
            "x and v only; use LeastAction or MFET."
        )
    return osc.noise
