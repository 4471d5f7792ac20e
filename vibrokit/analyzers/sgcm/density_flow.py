"""DensityFlow: the flow without noise between the nodes of a grid, in legs at whose ends noise acts."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Callable, Iterator
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.metastability import noise_strength
from vibrokit.analyzers.sgcm.density_grid import DensityGrid
from vibrokit.arguments import whole
from vibrokit.errors import StructureError
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.stopping import COMPLETED
from vibrokit.kernels.vector_field import VectorField
from vibrokit.oscillator import Oscillator
from vibrokit.progress import advance, stage
from vibrokit.structure.linear_map import linear_map
from vibrokit.symbolic.flow_kind import Flow

# Noise acts at the nodes of Gauss-Legendre quadrature with two nodes. On hertz-0.570 at D = 2e-5 and 340² nodes, ln of
# the rate from the clear orbit is -6.379 with 18 of them in a section interval, -6.432 with 24 and -6.434 with 36; at
# equal distances it is -6.381 with 18. Each flow adds an error of interpolation, so that more are not better.
_PER_RADIAN = 2.0  # of the fastest oscillation or decay: 24 in a forcing period of hertz-0.570
_GAUSS = (0.5 - 0.5 / math.sqrt(3.0), 0.5 + 0.5 / math.sqrt(3.0))
ABSORBED = 1 - 1e-9
"""Share of the probability that a set takes up where it covers a cell."""
SAME = 1e-9
"""Of a section interval: times that differ by less are equal."""

Array = NDArray[np.float64]
Beyond = Callable[[Array], Array]

_NOWHERE = np.empty((0, 0))
_MIRROR = np.array([1.0, -1.0])  # the reversed flow has −v in place of v


@dataclasses.dataclass(frozen=True, eq=False)
class Leg:
    """The flow over a piece of time, between the nodes of a grid, after which noise acts.

    `feet` (nx, nv, 2) are the places, in node spacings, from which the motion comes that ends at each node; or, for a
    leg backwards, to which the motion goes that starts there. They are NaN if it diverges.
    """

    feet: Array
    growth: Array  # ln of the factor by which the flow compresses areas; 0 for a leg backwards
    crossed: Array  # share of each cell whose motions have been at the exit; (0, 0) if position does not decide
    leaving: Array  # share of each cell whose motions leave the grid; past the exit, if position decides
    noise: float = 0.0  # for how long noise acts (s)


@dataclasses.dataclass(frozen=True, eq=False)
class DensityFlow:
    """What carries a density on a grid over a section interval."""

    scene: Oscillator
    stepper: Stepper
    grid: DensityGrid
    steps: int  # how often noise acts in a section interval; even
    beyond: Beyond | None = None  # how far states are beyond the exit, see `Exit.beyond`, if position decides

    @cached_property
    def legs(self) -> list[Leg]:
        """The legs of a section interval."""
        return [leg for leg, _ in self._both]

    @property
    def leg_times(self) -> Array:
        """When each leg of a section interval begins (s)."""
        return np.array([begin for begin, _, _ in self._pieces(0.0, self.scene.section_interval)])

    @cached_property
    def backward_legs(self) -> list[Leg]:
        """The legs that carry an expected value back over a section interval, the last one first."""
        noise = [0.0, *(leg.noise for leg in self.legs[:-1])]
        return [dataclasses.replace(back, noise=time) for (_, back), time in zip(self._both, noise, strict=True)][::-1]

    @cached_property
    def _both(self) -> list[tuple[Leg, Leg]]:
        return self._made(0.0, self.scene.section_interval)

    def between(self, start: float, end: float) -> list[Leg]:
        """Return the legs of a part of a section interval, from `start` to `end` since the section (s).

        Noise acts as often as in a whole interval, for their times.
        """
        return [leg for leg, _ in self._made(start, end)]

    @cached_property
    def amplitude(self) -> Array:
        """The strength of the noise at the nodes."""
        amplitude = noise_strength(self.scene, self.grid.nodes)
        if np.ptp(amplitude) <= 1e-9 * amplitude.max():  # additive noise, which takes a third of the time
            amplitude[:] = amplitude.mean()
        return amplitude

    def beyond_exit(self, nodes: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return the nodes at which motions from some nodes end a leg in which they have been at the exit."""
        arrivals = np.zeros(self.grid.shape, dtype=bool)
        for leg in self.legs:
            held = self.grid.holds(leg.feet)
            i, j = np.moveaxis(np.rint(np.where(held[..., None], leg.feet, 0.0)).astype(int), -1, 0)
            arrivals |= held & nodes[i, j] & (leg.crossed > 0)
        return arrivals

    def _made(self, start: float, end: float) -> list[tuple[Leg, Leg]]:
        """Legs in both directions; those of an autonomous scene that are equally long share their arrays."""
        known: dict[int, tuple[Leg, Leg]] = {}
        legs, pieces = [], list(self._pieces(start, end))
        with stage("flow between nodes", unit="legs", total=len(pieces)):
            for begin, stop, noise_time in pieces:
                place = stop - begin if self.scene.autonomous else begin
                key = round(place / (SAME * self.scene.section_interval))
                if key not in known:
                    known[key] = self._leg(begin, stop)
                leg, back = known[key]
                legs.append((dataclasses.replace(leg, noise=noise_time), back))
                advance()
        return legs

    def _pieces(self, start: float, end: float) -> Iterator[tuple[float, float, float]]:
        """When each leg begins and ends, and for how long noise acts then."""
        share = (end - start) / self.scene.section_interval
        count = max(1, math.ceil(self.steps // 2 * share - SAME))
        step = (end - start) / count
        times = [start + (number + place) * step for number in range(count) for place in _GAUSS]
        for begin, stop in itertools.pairwise([start, *times, end]):
            yield begin, stop, 0.5 * step if stop < end else 0.0

    def _leg(self, start: float, end: float) -> tuple[Leg, Leg]:
        """A leg, backwards from all nodes and forwards again for the derivatives, and one forwards from all nodes.

        In the second one, what leaves the grid goes on as at its edge.
        """
        nodes = self.grid.nodes.reshape(-1, 2)
        mirrored, crossed = self._followed(Flow.STATE_REVERSED, nodes * _MIRROR, -end, end - start, _MIRROR)
        feet = mirrored * _MIRROR
        places = self.grid.places(feet)
        inside = self.grid.holds(places)
        local = linear_map(self.scene, feet[inside], self.stepper, start_time=start, interval=end - start)
        growth = np.zeros(len(nodes))
        with np.errstate(invalid="ignore", divide="ignore"):
            growth[inside] = -np.log(np.abs(np.linalg.det(local.derivatives)))
        places[~np.isfinite(growth)] = np.nan
        images, passed = self._followed(Flow.STATE, nodes, start, end - start, np.ones(2))
        shape, ahead = self.grid.shape, self.grid.places(images)
        leaving = np.where(self.grid.holds(ahead).reshape(shape), 0.0, 1.0 if self.beyond is None else passed)
        kept = np.clip(ahead, 0.0, np.array(shape) - 1.0).reshape(*shape, 2)
        return (
            Leg(places.reshape(*shape, 2), np.nan_to_num(growth).reshape(shape), crossed, leaving),
            Leg(kept, np.zeros(shape), passed, _NOWHERE),
        )

    def _followed(self, flow: Flow, states: Array, start: float, duration: float, sign: Array) -> tuple[Array, Array]:
        """States at the end, NaN if they diverge, and the share of cells that has been at the exit.

        Motion that ended on its way forwards, as at a pole, is out. `sign` undoes a reflection.
        """
        checks = 1 if self.beyond is None else 16  # hertz-0.570: a mass that turns back between two went 1e-5 further
        farthest = np.full(len(states), -np.inf) if self.beyond is None else self.beyond(states * sign)
        for number in range(checks):
            begin, interval = start + number * duration / checks, duration / checks
            ended = run_ensemble(self.scene, flow, self.stepper, states, start_time=begin, interval=interval)
            states = np.where((ended.status == COMPLETED)[:, None], ended.states, np.nan)
            if self.beyond is not None:
                farthest = np.fmax(farthest, self.beyond(states * sign))
        if self.beyond is None:
            return states, _NOWHERE
        share = self.grid.share(farthest)
        if flow is Flow.STATE:
            share[np.isnan(states[:, 0]).reshape(share.shape)] = 1.0
        return states, ABSORBED * share


def steps_for(osc: Oscillator, states: Array) -> int:
    """Return how often noise must act in a section interval, for how fast small deviations turn or decay.

    The exact flow treats contacts; a step limits only how long noise is saved up before it is carried along. So the
    rate is the median over the states, which short contacts do not change.
    """
    rates = np.abs(np.linalg.eigvals(VectorField(osc).jacobian(states))).max(axis=1)
    return max(2 * math.ceil(_PER_RADIAN * float(np.median(rates)) * osc.section_interval / 2), 8)


def check_steps(caller: str, steps: object) -> None:
    """Raise StructureError if noise cannot act so often in a section interval."""
    whole(f"{caller}: steps", steps, 2, 4096)
    if isinstance(steps, int) and steps % 2:
        raise StructureError(f"{caller}: steps must be an even number, got {steps}; they come in pairs.")


def check_memory(osc: Oscillator, shape: tuple[int, int], steps: int, allowed: float, flows: float = 1.0) -> None:
    """Raise StructureError if the legs of so many flows, in both directions, need more memory than allowed (GiB)."""
    needed = flows * 2 * shape[0] * shape[1] * (3 if osc.autonomous else steps + 1) * 3 * 8 / 2**30
    if needed > allowed:
        raise StructureError(
            f"{shape[0]} × {shape[1]} nodes and {steps} steps need {needed:.3g} GiB of memory, and max_memory_gib is "
            f"{allowed:.3g}; lower nodes or steps, or raise max_memory_gib."
        )
