"""Minimal fatal shocks, the smallest kicks that leave a basin (Klinshov, Nekorkin & Kurths, New J. Phys. 18, 2015)."""

from __future__ import annotations

import concurrent.futures
import dataclasses
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrokit.arguments import whole
from vibrokit.construction import called
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.named import named_stepper
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.progress import Progress, advance, stage, working
from vibrokit.results.attractor import Attractor
from vibrokit.results.basins import UNSETTLED
from vibrokit.results.shock import ShapeStability, Shock
from vibrokit.results.structure import Structure
from vibrokit.structure.basins.classifier import BasinClassifier
from vibrokit.structure.validation import check_belongs, check_means
from vibrokit.symbolic.flow_kind import Flow

_RADII = 64  # sizes along each direction, of which the first fatal one and the one before are a bracket
_HALVINGS = 30
_ZOOMS = 4  # refinements around the best direction and time
_ZOOM = 4.0
_SETS = 64  # points of an attractor that never repeats
_MOST = 10**5

Array = NDArray[np.float64]


@called
def shape_stability(
    osc: Oscillator,
    structure: Structure,
    *,
    phases: int = 16,
    directions: int = 90,
    stepper: Stepper | None = None,
    executor: concurrent.futures.Executor | None = None,
    progress: Progress = None,
    time_limit: float | None = None,
) -> tuple[ShapeStability, ...]:
    """Return for each attractor its basin fraction and the smallest kicks that leave its basin.

    Kicks are tried at `phases` equally spaced times of the orbit, in `directions` directions, at sizes up to the size
    of the region; the smallest fatal kick is then refined around its time, direction and size. A kick is fatal if it
    leads to another attractor or out of the region for good. Basins can have holes that these kicks miss, so the size
    is an upper bound.

    Nothing is returned on Ctrl-C, which raises KeyboardInterrupt, or after the time limit.

    Parameters
    ----------
    osc : Oscillator
    structure : Structure
        Of this oscillator.
    phases, directions : int
        Number of times and of directions that are tried first.
    stepper : Stepper, optional
        By default that of the basins.
    executor : concurrent.futures.Executor, optional
    progress : bool or callable, optional
        True shows progress on standard error; a function is called with each `vibrokit.progress.Update`.
    time_limit : float, optional
        In seconds.

    Returns
    -------
    tuple of ShapeStability

    Raises
    ------
    OutOfTime
        The time limit was reached.
    StructureError
        Counts that are not whole numbers, 1 or more; a structure of another scene.
    """
    check_means(osc, stepper, executor)
    check_belongs(osc, structure)
    phases, directions = whole("phases", phases, 1, _MOST), whole("directions", directions, 4, _MOST)
    classifier = BasinClassifier.of(osc, structure, stepper or named_stepper(structure.stepper), executor)
    angles = 2 * np.pi * (np.arange(directions) + 0.5) / directions
    searches = {"velocity_kick": (np.array([0.5, 1.5]) * np.pi, 0.0), "any_kick": (angles, 2 * np.pi / directions)}
    found = []
    with working(progress, time_limit), stage("kicks", unit="searches", total=2 * len(structure.attractors)):
        classifier = classifier.sharing(structure.basins)
        for attractor in structure.attractors:
            kicks: dict[str, Shock | None] = {}
            for name, (tried, width) in searches.items():
                kicks[name] = _KickSearch(osc, classifier, attractor).smallest(tried, width, phases)
                advance()
            found.append(
                ShapeStability(attractor.label, attractor.basin_fraction, attractor.basin_fraction_error, **kicks)
            )
    return tuple(found)


@dataclasses.dataclass(frozen=True, eq=False)
class _Rays:
    """Straight lines from states of an attractor."""

    origins: Array  # (count, n), points of the attractor on the section
    lags: Array  # (count,), times from these to the states (s)
    states: Array  # (count, n)
    angles: Array  # (count,)

    def __len__(self) -> int:
        return len(self.angles)

    def chosen(self, which: Any) -> _Rays:
        return _Rays(self.origins[which], self.lags[which], self.states[which], self.angles[which])


class _KickSearch:
    """The search for the smallest fatal kick to one attractor."""

    def __init__(self, osc: Oscillator, classifier: BasinClassifier, attractor: Attractor) -> None:
        self.osc, self.classifier, self.attractor = osc, classifier, attractor
        widths = np.diff(classifier.region.bounds).ravel()
        self.reach = math.hypot(osc.natural_frequency * widths[0], widths[1])

    def smallest(self, angles: Array, width: float, phases: int) -> Shock | None:
        """Try all times and angles first, then refine around the best; `width` is the angle between two."""
        starts, step = self._starts(phases)
        rays = self._rays(starts, angles)
        low, high, limits = self._bracket(rays, np.zeros(len(rays)), np.full(len(rays), self.reach))
        if not np.isfinite(high).any():
            return None
        best = self._best(rays, low, high, limits)
        for _ in range(_ZOOMS if self.attractor.repeats else 0):
            width, step = width / _ZOOM, step / _ZOOM
            offsets = np.arange(-_ZOOM, _ZOOM + 1)
            near = self._near(best[1].origins[0], float(best[1].lags[0]), step * offsets)
            rays = self._rays(near, np.unique(best[1].angles[0] + width * offsets))
            around = best[2] * (1 + 1e-9), 0.5 * best[2]
            low, high, limits = self._bracket(rays, np.full(len(rays), around[1]), np.full(len(rays), around[0]))
            if np.isfinite(high).any():
                found = self._best(rays, low, high, limits)
                error = max(best[2] - found[2], found[3])
                best = (found[0], found[1], found[2], error) if found[2] <= best[2] else best
        target, ray, size, error = best
        (kick,) = self._kick(ray.angles, np.array([size]))
        return Shock(self.attractor.label, target, size, error, kick, ray.states[0], float(self._times(ray)[0]))

    def _starts(self, phases: int) -> tuple[list[tuple[Array, float]], float]:
        """Return points of the attractor and lags that lead to states all along it, and the time between two."""
        attractor = self.attractor
        if attractor.kind == "equilibrium":
            return [(attractor.points[0], 0.0)], 0.0
        step = (attractor.duration if attractor.kind == "limit cycle" else self.osc.section_interval) / phases
        points = attractor.points[: attractor.period or _SETS]
        return [(point, k * step) for point in points for k in range(phases)], step

    def _near(self, origin: Array, lag: float, offsets: Array) -> list[tuple[Array, float]]:
        """Return the same motion a little earlier and later, within the period."""
        kind, duration = self.attractor.kind, self.attractor.duration
        if kind == "equilibrium":
            return [(origin, lag)]
        if kind == "limit cycle":
            lags = (lag + offsets) % duration
        else:
            lags = np.unique(np.clip(lag + offsets, 0.0, self.osc.section_interval * (1 - 1e-12)))
        return [(origin, float(lag)) for lag in lags]

    def _rays(self, starts: list[tuple[Array, float]], angles: Array) -> _Rays:
        """Return rays of all angles from the motion some lags after points of the attractor."""
        origins, lags = np.array([origin for origin, _ in starts]), np.array([lag for _, lag in starts])
        states = origins.copy()
        for index in np.flatnonzero(lags > 0):
            ended = run_ensemble(
                self.osc, Flow.STATE, self.classifier.stepper, origins[[index]], interval=float(lags[index])
            )  # fmt: skip
            states[index] = ended.states[0]
        every = np.repeat(np.arange(len(starts)), len(angles))
        return _Rays(origins[every], lags[every], states[every], np.tile(angles, len(starts)))

    def _times(self, rays: _Rays) -> Array:
        """Return the times of the states after the section (s); these are 0 in an autonomous scene."""
        return np.zeros(len(rays)) if self.attractor.kind == "limit cycle" else rays.lags

    def _kick(self, angles: Array, sizes: Array) -> Array:
        return np.stack([sizes * np.cos(angles) / self.osc.natural_frequency, sizes * np.sin(angles)], axis=1)

    def _limits(self, rays: _Rays, sizes: Array) -> NDArray[np.int64]:
        """Return the labels that states at some distance along the rays lead to."""
        states, times = rays.states.copy(), self._times(rays)
        states[:, :2] += self._kick(rays.angles, sizes)
        limits = np.empty(len(rays), dtype=np.int64)
        for time in np.unique(times):
            now = times == time
            limits[now] = self.classifier.labels(states[now], start_time=float(time))
        return limits

    def _fatal(self, limits: NDArray[np.int64]) -> NDArray[np.bool_]:
        return (limits != self.attractor.label) & (limits != UNSETTLED)

    def _bracket(self, rays: _Rays, low: Array, high: Array) -> tuple[Array, Array, NDArray[np.int64]]:
        """Return for each ray a size that is not fatal, the next one that is or infinity, and the label it leads to."""
        sizes = low[:, None] + (high - low)[:, None] * (np.arange(1, _RADII + 1) / _RADII)
        every = rays.chosen(np.repeat(np.arange(len(rays)), _RADII))
        limits = self._limits(every, sizes.ravel()).reshape(sizes.shape)
        fatal = self._fatal(limits)
        first = np.argmax(fatal, axis=1)
        row = np.arange(len(rays))
        before = np.where(first > 0, sizes[row, np.maximum(first - 1, 0)], low)
        none = ~fatal.any(axis=1)
        return np.where(none, high, before), np.where(none, np.inf, sizes[row, first]), limits[row, first]

    def _best(self, rays: _Rays, low: Array, high: Array, limits: NDArray[np.int64]) -> tuple[int, _Rays, float, float]:
        """Narrow the brackets that can contain the smallest size; return its label, its ray, the size and its error."""
        could = np.flatnonzero(low <= high.min())
        could = could[np.argsort(high[could])]
        near, low, high, limits = rays.chosen(could), low[could], high[could], limits[could]
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            reached = self._limits(near, middle)
            fatal = self._fatal(reached)
            low, high = np.where(fatal, low, middle), np.where(fatal, middle, high)
            limits = np.where(fatal, reached, limits)
            kept = low <= high.min()
            near, low, high, limits = near.chosen(kept), low[kept], high[kept], limits[kept]
        best = int(np.argmin(high))
        return int(limits[best]), near.chosen([best]), float(high[best]), float(high[best] - low[best])
