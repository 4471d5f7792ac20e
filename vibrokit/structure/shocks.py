"""Minimal fatal shocks: the smallest kick that leaves a basin (Klinshov, Nekorkin & Kurths, New J. Phys. 18, 2015)."""

from __future__ import annotations

import concurrent.futures
import dataclasses
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrokit.kernels.ensemble import Progress, run_ensemble
from vibrokit.kernels.named import named_stepper
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.results.basins import UNSETTLED
from vibrokit.results.shock import ShapeStability, Shock
from vibrokit.results.structure import Structure
from vibrokit.structure.request import check_belongs, check_means, whole
from vibrokit.structure.settle import Settler
from vibrokit.symbolic.flow_kind import Flow

_RADII = 64  # looked at along each direction, before the first fatal one is bracketed
_HALVINGS = 30
_ZOOMS = 4  # rounds of a finer look round the best direction and time
_ZOOM = 4.0
_SETS = 64  # points of an attractor that never repeats
_MOST = 10**5

Array = NDArray[np.float64]


def shape_stability(
    osc: Oscillator,
    structure: Structure,
    *,
    phases: int = 16,
    directions: int = 90,
    stepper: Stepper | None = None,
    executor: concurrent.futures.Executor | None = None,
    progress: Progress | None = None,
) -> tuple[ShapeStability, ...]:
    """Return for each attractor its basin fraction and the smallest kicks that leave its basin.

    Kicks are tried at `phases` equally spaced times of the orbit, in `directions` directions, at sizes up to the size
    of the region; the smallest that is fatal is then approached by looking ever finer round its time, direction and
    size. A kick is fatal if the motion after it comes to another attractor or leaves for good. Basins can have holes
    finer than this sees, so the size is an upper bound.

    Parameters
    ----------
    osc : Oscillator
    structure : Structure
        Of this oscillator.
    phases, directions : int
        How finely times and directions are looked at first.
    stepper : Stepper, optional
        By default the one that the basins were made with.
    executor : concurrent.futures.Executor, optional
    progress : callable, optional
        Called with (searches done, searches in all).

    Returns
    -------
    tuple of ShapeStability

    Raises
    ------
    StructureError
        Counts that are not whole numbers, 1 or more; a structure of another scene.
    """
    check_means(osc, stepper, executor, progress)
    check_belongs(osc, structure)
    phases, directions = whole("phases", phases, 1, _MOST), whole("directions", directions, 4, _MOST)
    carrier = stepper or named_stepper(structure.stepper)
    settler = Settler(
        osc, structure.attractors, structure.basins.region, structure.settling, structure.budget, carrier, executor
    ).sharing(structure.basins, 2)
    angles = 2 * np.pi * (np.arange(directions) + 0.5) / directions
    done, found = 0, []
    for attractor in structure.attractors:
        kicks: list[Shock | None] = []
        for looked_at, width in ((np.array([0.5, 1.5]) * np.pi, 0.0), (angles, 2 * np.pi / directions)):
            kicks.append(_Hunt(osc, settler, attractor).smallest(looked_at, width, phases))
            done += 1
            if progress is not None:
                progress(done, 2 * len(structure.attractors))
        found.append(ShapeStability(attractor.label, attractor.basin_fraction, attractor.basin_fraction_error, *kicks))
    return tuple(found)


@dataclasses.dataclass(frozen=True, eq=False)
class _Moment:
    """A state of the attractor, and how it is come to.

    Attributes
    ----------
    origin : array (n,)
        A point of the attractor on the section.
    lag : float
        Time from there to the state (s).
    state : array (n,)
    time : float
        Of the state after the section (s): the lag, but 0 in an autonomous scene, where all times are alike.
    """

    origin: Array
    lag: float
    state: Array
    time: float


@dataclasses.dataclass(frozen=True, eq=False)
class _Rays:
    """Straight lines out of the attractor: which of some moments each starts at, and which way it goes."""

    moments: list[_Moment]
    starts: NDArray[np.intp]
    angles: Array

    @classmethod
    def from_each(cls, moments: list[_Moment], angles: Array) -> _Rays:
        """All angles at every moment."""
        return cls(moments, np.repeat(np.arange(len(moments)), len(angles)), np.tile(angles, len(moments)))

    def __len__(self) -> int:
        return len(self.starts)

    @property
    def states(self) -> Array:
        return np.array([moment.state for moment in self.moments])[self.starts]

    @property
    def times(self) -> Array:
        return np.array([moment.time for moment in self.moments])[self.starts]

    def chosen(self, which: Any) -> _Rays:
        return _Rays(self.moments, self.starts[which], self.angles[which])

    def only(self) -> tuple[_Moment, float]:
        """Where a single ray starts, and its angle."""
        return self.moments[int(self.starts[0])], float(self.angles[0])


class _Hunt:
    """The search for the smallest fatal kick to one attractor."""

    def __init__(self, osc: Oscillator, settler: Settler, attractor: Attractor) -> None:
        self.osc, self.settler, self.attractor = osc, settler, attractor
        widths = np.diff(settler.region.bounds).ravel()
        self.reach = math.hypot(osc.natural_frequency * widths[0], widths[1])

    def smallest(self, angles: Array, width: float, phases: int) -> Shock | None:
        """Look at all times and angles first, then ever closer round the best; `width` is the angle between two."""
        moments, step = self._moments(phases)
        rays = _Rays.from_each(moments, angles)
        low, high, fates = self._bracket(rays, np.zeros(len(rays)), np.full(len(rays), self.reach))
        if not np.isfinite(high).any():
            return None
        best = self._best(rays, low, high, fates)
        for _ in range(_ZOOMS if self.attractor.repeats else 0):
            width, step = width / _ZOOM, step / _ZOOM
            offsets = np.arange(-_ZOOM, _ZOOM + 1)
            moment, angle = best[1].only()
            rays = _Rays.from_each(self._near(moment, step * offsets), np.unique(angle + width * offsets))
            around = best[2] * (1 + 1e-9), 0.5 * best[2]
            low, high, fates = self._bracket(rays, np.full(len(rays), around[1]), np.full(len(rays), around[0]))
            if np.isfinite(high).any():
                found = self._best(rays, low, high, fates)
                error = max(best[2] - found[2], found[3])
                best = (found[0], found[1], found[2], error) if found[2] <= best[2] else best
        fate, ray, size, error = best
        moment, _ = ray.only()
        kick = self._kick(ray.angles, np.array([size]))[0]
        return Shock(self.attractor.label, fate, size, error, kick, moment.state, moment.time)

    def _moments(self, phases: int) -> tuple[list[_Moment], float]:
        """States of the attractor all along it; and the time between two."""
        attractor = self.attractor
        if attractor.kind == "equilibrium":
            return [_Moment(attractor.points[0], 0.0, attractor.points[0], 0.0)], 0.0
        step = (attractor.duration if attractor.kind == "limit cycle" else self.osc.section_interval) / phases
        points = attractor.points[: attractor.period or _SETS]
        return [self._moment(point, k * step) for point in points for k in range(phases)], step

    def _near(self, moment: _Moment, offsets: Array) -> list[_Moment]:
        """The same motion a little earlier and later, within the period that the moment is in."""
        kind, duration = self.attractor.kind, self.attractor.duration
        if kind == "equilibrium":
            return [moment]
        if kind == "limit cycle":
            lags = (moment.lag + offsets) % duration
        else:
            lags = np.unique(np.clip(moment.lag + offsets, 0.0, self.osc.section_interval * (1 - 1e-12)))
        return [self._moment(moment.origin, float(lag)) for lag in lags]

    def _moment(self, origin: Array, lag: float) -> _Moment:
        state = origin
        if lag > 0:
            ended = run_ensemble(self.osc, Flow.STATE, self.settler.stepper, origin[None], interval=lag)
            state = ended.states[0]
        return _Moment(origin, lag, state, 0.0 if self.attractor.kind == "limit cycle" else lag)

    def _kick(self, angles: Array, sizes: Array) -> Array:
        return np.stack([sizes * np.cos(angles) / self.osc.natural_frequency, sizes * np.sin(angles)], axis=1)

    def _fates(self, rays: _Rays, sizes: Array) -> NDArray[np.int64]:
        """Where the states at some distance along the rays lead, time by time."""
        states, times = rays.states, rays.times
        states[:, :2] += self._kick(rays.angles, sizes)
        fates = np.empty(len(rays), dtype=np.int64)
        for time in np.unique(times):
            now = times == time
            fates[now] = self.settler.labels(states[now], start_time=float(time))
        return fates

    def _fatal(self, fates: NDArray[np.int64]) -> NDArray[np.bool_]:
        return (fates != self.attractor.label) & (fates != UNSETTLED)

    def _bracket(self, rays: _Rays, low: Array, high: Array) -> tuple[Array, Array, NDArray[np.int64]]:
        """For each ray: a size that is not fatal, the next one that is (infinite if none), and where that leads."""
        shares = np.arange(1, _RADII + 1) / _RADII
        sizes = low[:, None] + (high - low)[:, None] * shares
        every = rays.chosen(np.repeat(np.arange(len(rays)), _RADII))
        fates = self._fates(every, sizes.ravel()).reshape(sizes.shape)
        fatal = self._fatal(fates)
        first = np.argmax(fatal, axis=1)
        row = np.arange(len(rays))
        before = np.where(first > 0, sizes[row, np.maximum(first - 1, 0)], low)
        none = ~fatal.any(axis=1)
        return np.where(none, high, before), np.where(none, np.inf, sizes[row, first]), fates[row, first]

    def _best(self, rays: _Rays, low: Array, high: Array, fates: NDArray[np.int64]) -> tuple[int, _Rays, float, float]:
        """Narrow the brackets that could hold the smallest size; return its fate, its ray, the size and its error."""
        could = np.flatnonzero(low <= high.min())
        could = could[np.argsort(high[could])]
        near, low, high, fates = rays.chosen(could), low[could], high[could], fates[could]
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            seen = self._fates(near, middle)
            fatal = self._fatal(seen)
            low, high = np.where(fatal, low, middle), np.where(fatal, middle, high)
            fates = np.where(fatal, seen, fates)
            open_ones = low <= high.min()
            near, low, high, fates = near.chosen(open_ones), low[open_ones], high[open_ones], fates[open_ones]
        best = int(np.argmin(high))
        return int(fates[best]), near.chosen([best]), float(high[best]), float(high[best] - low[best])
