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
class _Rays:
    """Straight lines out of the attractor: where and when each starts, and which way it goes."""

    states: Array
    times: Array
    angles: Array

    def __len__(self) -> int:
        return len(self.states)

    def chosen(self, which: Any) -> _Rays:
        return _Rays(self.states[which], self.times[which], self.angles[which])


class _Hunt:
    """The search for the smallest fatal kick to one attractor."""

    def __init__(self, osc: Oscillator, settler: Settler, attractor: Attractor) -> None:
        self.osc, self.settler, self.attractor = osc, settler, attractor
        widths = np.diff(settler.region.bounds).ravel()
        self.reach = math.hypot(osc.natural_frequency * widths[0], widths[1])

    def smallest(self, angles: Array, width: float, phases: int) -> Shock | None:
        """Look at all times and angles first, then ever closer round the best; `width` is the angle between two."""
        moments, step = self._moments(phases)
        rays = self._rays(moments, angles)
        low, high, fates = self._bracket(rays, np.zeros(len(rays)), np.full(len(rays), self.reach))
        if not np.isfinite(high).any():
            return None
        best = self._best(rays, low, high, fates)
        for _ in range(_ZOOMS if self.attractor.repeats else 0):
            width, step = width / _ZOOM, step / _ZOOM
            offsets = np.arange(-_ZOOM, _ZOOM + 1)
            near = np.unique(best[1].angles[0] + width * offsets)
            rays = self._rays(self._near(best[1], step * offsets), near)
            around = best[2] * (1 + 1e-9), 0.5 * best[2]
            low, high, fates = self._bracket(rays, np.full(len(rays), around[1]), np.full(len(rays), around[0]))
            if np.isfinite(high).any():
                found = self._best(rays, low, high, fates)
                error = max(best[2] - found[2], found[3])
                best = (found[0], found[1], found[2], error) if found[2] <= best[2] else best
        fate, ray, size, error = best
        state, time = ray.states[0], float(ray.times[0])
        return Shock(self.attractor.label, fate, size, error, self._kick(ray.angles, np.array([size]))[0], state, time)

    def _moments(self, phases: int) -> tuple[list[tuple[Array, float]], float]:
        """States of the attractor with their times after the section; and the time between two."""
        attractor, osc = self.attractor, self.osc
        if attractor.kind == "equilibrium":
            return [(attractor.points[0], 0.0)], 0.0
        if attractor.kind == "limit cycle":
            step = attractor.duration / phases
            return [(self._carried(attractor.points[0], 0.0, k * step), 0.0) for k in range(phases)], step
        step = osc.section_interval / phases
        points = attractor.points[: attractor.period or _SETS]
        return [(self._carried(point, 0.0, k * step), k * step) for point in points for k in range(phases)], step

    def _near(self, ray: _Rays, offsets: Array) -> list[tuple[Array, float]]:
        """The same motion a little earlier and later, within the period that the ray is in."""
        state, time, interval = ray.states[0], float(ray.times[0]), self.osc.section_interval
        if self.attractor.kind == "equilibrium":
            return [(state, time)]
        if self.attractor.kind == "limit cycle":
            start, phase = self.attractor.points[0], self._phase_of(state)
            return [(self._carried(start, 0.0, (phase + o) % self.attractor.duration), 0.0) for o in offsets]
        start = self._section_point(state, time)
        times = np.unique(np.clip(time + offsets, 0.0, interval * (1 - 1e-12)))
        return [(self._carried(start, 0.0, float(t)), float(t)) for t in times]

    def _section_point(self, state: Array, time: float) -> Array:
        """The point of the section that leads to a state of the attractor in some time."""
        points = self.attractor.points
        ahead = np.array([self._carried(point, 0.0, time) for point in points])
        return points[int(np.argmin(np.linalg.norm(ahead - state, axis=1)))]

    def _phase_of(self, state: Array) -> float:
        """Time along a limit cycle at which a state lies on it."""
        orbit = self.attractor.orbit
        nearest = int(np.argmin(np.linalg.norm(orbit - state[:2], axis=1)))
        return self.attractor.duration * nearest / (len(orbit) - 1)

    def _carried(self, state: Array, start: float, duration: float) -> Array:
        if duration == 0.0:
            return state
        ended = run_ensemble(
            self.osc, Flow.STATE, self.settler.stepper, state[None], 1, start_time=start, interval=duration
        )
        return ended.states[0]

    def _rays(self, moments: list[tuple[Array, float]], angles: Array) -> _Rays:
        states = np.repeat([state for state, _ in moments], len(angles), axis=0)
        return _Rays(states, np.repeat([time for _, time in moments], len(angles)), np.tile(angles, len(moments)))

    def _kick(self, angles: Array, sizes: Array) -> Array:
        return np.stack([sizes * np.cos(angles) / self.osc.natural_frequency, sizes * np.sin(angles)], axis=1)

    def _fates(self, rays: _Rays, sizes: Array) -> NDArray[np.int64]:
        """Where the states at some distance along the rays lead, time by time."""
        states = rays.states.copy()
        states[:, :2] += self._kick(rays.angles, sizes)
        fates = np.empty(len(rays), dtype=np.int64)
        for time in np.unique(rays.times):
            now = rays.times == time
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
