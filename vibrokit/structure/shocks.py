"""Minimal fatal shocks, the smallest kicks that leave a basin (Klinshov, Nekorkin & Kurths, New J. Phys. 18, 2015)."""

from __future__ import annotations

import concurrent.futures
import dataclasses
import math
from collections.abc import Sequence

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
from vibrokit.results.basins import UNSETTLED, ShapeStability, Shock
from vibrokit.results.structure import Structure
from vibrokit.structure.basins.classifier import BasinClassifier
from vibrokit.structure.validation import check_belongs, check_means
from vibrokit.symbolic.flow_kind import Flow

_RADII = 64  # sizes along each direction, of which the first fatal one and the one before are a bracket
_ZOOM = 4.0  # ratio of the spacings of directions and times from one refinement to the next

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
    phases, directions = whole("phases", phases, 1, 10**5), whole("directions", directions, 4, 10**5)
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
class _Kick:
    """A fatal kick: some time after a point of the attractor, in a direction."""

    origin: Array  # (n,), a point of the attractor on the section
    lag: float  # time from there to the state before the kick (s)
    state: Array  # (n,)
    angle: float
    size: float
    error: float
    target: int


class _KickSearch:
    """The search for the smallest fatal kick to one attractor."""

    def __init__(self, osc: Oscillator, classifier: BasinClassifier, attractor: Attractor) -> None:
        self.osc, self.classifier, self.attractor = osc, classifier, attractor
        widths = classifier.region.widths
        self.reach = math.hypot(osc.reference_frequency * widths[0], widths[1])

    def smallest(self, angles: Array, width: float, phases: int) -> Shock | None:
        """Try all times and angles first, then refine around the best; `width` is the angle between two."""
        attractor, step = self.attractor, self.osc.section_interval / phases
        if attractor.kind in ("equilibrium", "limit cycle"):
            step = attractor.duration / phases
        points = attractor.points[: attractor.period or 64]
        starts = [(point, k * step) for point in points for k in range(phases if step else 1)]
        best = self._smallest(starts, angles, 0.0, self.reach)
        if best is None:
            return None
        for _ in range(4 if attractor.repeats else 0):
            width, step = width / _ZOOM, step / _ZOOM
            offsets = np.arange(-_ZOOM, _ZOOM + 1)
            near, around = self._near(best.lag, step * offsets), np.unique(best.angle + width * offsets)
            starts = [(best.origin, lag) for lag in near]
            found = self._smallest(starts, around, 0.5 * best.size, best.size * (1 + 1e-9))
            if found is not None and found.size <= best.size:
                best = dataclasses.replace(found, error=max(best.size - found.size, found.error))
        (kick,) = self._offsets(np.array([best.angle]), np.array([best.size]))
        time = 0.0 if attractor.kind == "limit cycle" else best.lag  # any time is a section then
        return Shock(attractor.label, best.target, best.size, best.error, kick, best.state, time)

    def _near(self, lag: float, offsets: Array) -> list[float]:
        """Times a little earlier and later, within the period."""
        if self.attractor.kind == "equilibrium":
            return [lag]
        if self.attractor.kind == "limit cycle":
            return [float(each) for each in (lag + offsets) % self.attractor.duration]
        return np.unique(np.clip(lag + offsets, 0.0, self.osc.section_interval * (1 - 1e-12))).tolist()

    def _smallest(self, starts: Sequence[tuple[Array, float]], angles: Array, low: float, high: float) -> _Kick | None:
        """Return the smallest fatal kick between two sizes, some lags after points of the attractor; None for none."""
        lags, states = np.array([lag for _, lag in starts]), np.array([origin for origin, _ in starts])
        for index in np.flatnonzero(lags > 0):
            ended = run_ensemble(
                self.osc, Flow.STATE, self.classifier.stepper, states[[index]], interval=float(lags[index])
            )  # fmt: skip
            states[index] = ended.states[0]
        which, angles = np.repeat(np.arange(len(starts)), len(angles)), np.tile(angles, len(starts))

        def limits(rays: NDArray[np.intp], sizes: Array) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
            found = self._limits(states[which[rays]], lags[which[rays]], angles[rays], sizes)
            return found, (found != self.attractor.label) & (found != UNSETTLED)

        rays = np.arange(len(which))
        sizes = low + (high - low) * (np.arange(1, _RADII + 1) / _RADII)
        target, fatal = limits(np.repeat(rays, _RADII), np.tile(sizes, len(rays)))
        target, fatal = target.reshape(-1, _RADII), fatal.reshape(-1, _RADII)
        rays = np.flatnonzero(fatal.any(axis=1))
        if not rays.size:
            return None
        first = fatal[rays].argmax(axis=1)
        order = np.argsort(sizes[first])
        rays, first = rays[order], first[order]
        below, above, target = np.concatenate([[low], sizes])[first], sizes[first], target[rays, first]
        for _ in range(30):
            kept = below <= above.min()
            rays, below, above, target = rays[kept], below[kept], above[kept], target[kept]
            middle = 0.5 * (below + above)
            reached, fatal = limits(rays, middle)
            below, above = np.where(fatal, below, middle), np.where(fatal, middle, above)
            target = np.where(fatal, reached, target)
        best = int(np.argmin(above))
        start, size = which[rays[best]], float(above[best])
        return _Kick(
            starts[start][0], float(lags[start]), states[start], float(angles[rays[best]]), size,
            size - float(below[best]), int(target[best]),
        )  # fmt: skip

    def _offsets(self, angles: Array, sizes: Array) -> Array:
        return np.stack([sizes * np.cos(angles) / self.osc.reference_frequency, sizes * np.sin(angles)], axis=1)

    def _limits(self, states: Array, lags: Array, angles: Array, sizes: Array) -> NDArray[np.int64]:
        """Return the labels that states lead to after kicks."""
        kicked, found = states.copy(), np.empty(len(states), dtype=np.int64)
        kicked[:, :2] += self._offsets(angles, sizes)
        times = lags if self.attractor.kind != "limit cycle" else np.zeros_like(lags)
        for time in np.unique(times):
            found[times == time] = self.classifier.labels(kicked[times == time], start_time=float(time))
        return found
