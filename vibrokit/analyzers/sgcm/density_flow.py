"""DensityFlow: the flow without noise between the nodes of a grid, in legs at whose ends noise acts."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.neighbourhoods import noise_strength
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
_FEWEST = 8
MOST_STEPS = 4096
"""Largest number of times that noise acts in a section interval."""
_GAUSS = (0.5 - 0.5 / math.sqrt(3.0), 0.5 + 0.5 / math.sqrt(3.0))
_CHECKS = 16  # exit tests in a leg: on hertz-0.570 a mass that turns back between two has gone 1e-5 further
ABSORBED = 1 - 1e-9
"""Share of the probability that a set takes up where it covers a cell."""
_SAME = 1e-9  # of a section interval: times that differ by less are equal

Array = NDArray[np.float64]
Beyond = Callable[[Array], Array]

_NOWHERE = np.empty((0, 0))
_MIRROR = np.array([1.0, -1.0])  # the reversed flow has −v in place of v


@dataclasses.dataclass(frozen=True, eq=False)
class Leg:
    """The flow over a piece of time, between the nodes of a grid, after which noise acts.

    Attributes
    ----------
    feet : array (nx, nv, 2)
        Where the motion that ends at each node comes from, in node spacings; or, for a leg backwards, where the motion
        goes that starts there. NaN if it diverges.
    growth : array (nx, nv)
        ln of the factor by which the flow compresses areas; 0 for a leg backwards.
    crossed : array (nx, nv)
        Share of each cell whose motions have been at the exit in this time, from 0 to below 1. Its shape is (0, 0) if
        position does not decide.
    noise : float
        For how long noise acts (s).
    leaving : array (nx, nv) or None
        Share of each cell whose motions leave the grid, if that is asked for; where position decides, past the exit.
    """

    feet: Array
    growth: Array
    crossed: Array
    noise: float = 0.0
    leaving: Array | None = None


@dataclasses.dataclass(frozen=True, eq=False)
class DensityFlow:
    """What carries a density on a grid over a section interval.

    Attributes
    ----------
    scene : Oscillator
    stepper : Stepper
    grid : DensityGrid
    steps : int
        How often noise acts in a section interval; even.
    beyond : callable or None
        How far states are beyond the exit, see `Exit.beyond`, if position decides.
    watches_edge : bool
        Whether legs have `leaving`.
    """

    scene: Oscillator
    stepper: Stepper
    grid: DensityGrid
    steps: int
    beyond: Beyond | None = None
    watches_edge: bool = False

    @cached_property
    def legs(self) -> list[Leg]:
        """The legs of a section interval."""
        return self.between(0.0, self.scene.section_interval)

    @property
    def leg_times(self) -> Array:
        """When each leg of a section interval begins (s)."""
        return np.array([begin for begin, _, _ in self._pieces(0.0, self.scene.section_interval)])

    @cached_property
    def backward_legs(self) -> list[Leg]:
        """The legs that carry an expected value back over a section interval, the last one first."""
        pieces = list(self._pieces(0.0, self.scene.section_interval))
        noise = [0.0, *(time for _, _, time in pieces[:-1])]
        back = [(start, end, time) for (start, end, _), time in zip(pieces, noise, strict=True)]
        return self._made(back[::-1], self._from)

    def between(self, start: float, end: float) -> list[Leg]:
        """Return the legs of a part of a section interval, from `start` to `end` since the section (s).

        Noise acts as often as in a whole interval, for their times.
        """
        return self._made(list(self._pieces(start, end)), self._into)

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

    @staticmethod
    def memory(shape: tuple[int, int], steps: int, autonomous: bool) -> float:
        """Memory that legs take (GiB)."""
        return shape[0] * shape[1] * (3 if autonomous else steps + 1) * 3 * 8 / 2**30

    def _made(self, pieces: Sequence[tuple[float, float, float]], make: Callable[[float, float], Leg]) -> list[Leg]:
        """Legs of some pieces of time; those of an autonomous scene that are equally long share their arrays."""
        known: dict[int, Leg] = {}
        legs = []
        with stage("flow between nodes", unit="legs", total=len(pieces)):
            for begin, stop, noise_time in pieces:
                place = stop - begin if self.scene.autonomous else begin
                key = round(place / (_SAME * self.scene.section_interval))
                if key not in known:
                    known[key] = make(begin, stop)
                legs.append(dataclasses.replace(known[key], noise=noise_time))
                advance()
        return legs

    def _pieces(self, start: float, end: float) -> Iterator[tuple[float, float, float]]:
        """When each leg begins and ends, and for how long noise acts then."""
        share = (end - start) / self.scene.section_interval
        count = max(1, math.ceil(self.steps // 2 * share - _SAME))
        step = (end - start) / count
        times = [start + (number + place) * step for number in range(count) for place in _GAUSS]
        for begin, stop in itertools.pairwise([start, *times, end]):
            yield begin, stop, 0.5 * step if stop < end else 0.0

    def _into(self, start: float, end: float) -> Leg:
        """Integrate backwards in time from all nodes, and forwards again for the derivatives."""
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
        shape = self.grid.shape
        leaving: Array | None = None
        if self.watches_edge:
            images, passed = self._followed(Flow.STATE, nodes, start, end - start, np.ones(2))
            leaving = (~self.grid.holds(self.grid.places(images))).reshape(shape).astype(float)
            if self.beyond is not None:
                leaving *= passed
        return Leg(places.reshape(*shape, 2), np.nan_to_num(growth).reshape(shape), crossed, leaving=leaving)

    def _from(self, start: float, end: float) -> Leg:
        """Integrate forwards from all nodes; what leaves the grid goes on as at its edge."""
        nodes = self.grid.nodes.reshape(-1, 2)
        images, crossed = self._followed(Flow.STATE, nodes, start, end - start, np.ones(2))
        places = np.clip(self.grid.places(images), 0.0, np.array(self.grid.shape) - 1.0)
        return Leg(places.reshape(*self.grid.shape, 2), np.zeros(self.grid.shape), crossed)

    def _followed(self, flow: Flow, states: Array, start: float, duration: float, sign: Array) -> tuple[Array, Array]:
        """States at the end, NaN if they diverge, and the share of cells that has been at the exit.

        Where position decides, motion that ended on its way forwards, as at a pole, is out. `sign` undoes a reflection.
        """
        checks = 1 if self.beyond is None else _CHECKS
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
    return max(2 * math.ceil(_PER_RADIAN * float(np.median(rates)) * osc.section_interval / 2), _FEWEST)


def check_steps(caller: str, steps: object) -> None:
    """Raise StructureError if noise cannot act so often in a section interval."""
    whole(f"{caller}: steps", steps, 2, MOST_STEPS)
    if isinstance(steps, int) and steps % 2:
        raise StructureError(f"{caller}: steps must be an even number, got {steps}; they come in pairs.")


def check_memory(shape: tuple[int, int], needed: float, steps: int, allowed: float) -> None:
    """Raise StructureError if more memory is needed than allowed, both in GiB."""
    if needed > allowed:
        raise StructureError(
            f"{shape[0]} × {shape[1]} nodes and {steps} steps need {needed:.3g} GiB of memory, and max_memory_gib is "
            f"{allowed:.3g}; lower nodes or steps, or raise max_memory_gib."
        )
