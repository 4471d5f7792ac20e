"""Curves grown as images of a short piece, with bounds on their chords and angles."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from vibrokit.results.saddle import ManifoldEnd

MARGIN = 1.0
"""Fraction of its width and height by which a region is widened on every side; beyond that a curve is outside."""

_FLOOR = 0.01  # shortest chord that is divided because of its angle, in units of the spacing
_MOST_VERTICES = 100_000

Array = NDArray[np.float64]
Images = Callable[[Array, int], Array]
"""Images of states (count, 2) under a number of applications of a map; NaN where they diverged."""


@dataclasses.dataclass(frozen=True, eq=False)
class Limits:
    """Resolution of a curve, and where it ends; distances in units of the region's width and height."""

    low: Array
    width: Array
    spacing: float
    bend: float
    arc_length: float
    applications: float = math.inf  # of the map to a state, all together

    def inside(self, states: Array) -> NDArray[np.bool_]:
        """Whether states lie in the widened region; False for NaN."""
        place = (states - self.low) / self.width
        return np.asarray(((place >= -MARGIN) & (place <= 1.0 + MARGIN)).all(axis=1))

    def shape(self, states: Array) -> tuple[Array, Array]:
        """Length of each chord, and the angle by which the next one turns away from it."""
        steps = np.diff(states / self.width, axis=0)
        cross = steps[:-1, 0] * steps[1:, 1] - steps[:-1, 1] * steps[1:, 0]
        return np.linalg.norm(steps, axis=1), np.abs(np.arctan2(cross, (steps[:-1] * steps[1:]).sum(axis=1)))

    def coarse(self, states: Array) -> NDArray[np.bool_]:
        """Which chords must be divided."""
        chords, angles = self.shape(states)
        longer = np.maximum(chords[:-1], chords[1:])
        sharp = (angles > self.bend) | (longer * angles > 0.5 * self.spacing * self.bend)
        turning = np.zeros(len(chords), dtype=bool)
        turning[:-1] |= sharp
        turning[1:] |= sharp
        return ~(chords <= self.spacing) | (turning & (chords > _FLOOR * self.spacing))

    def needed(self, states: Array, remaining: float) -> int:
        """Number of an image's states up to the first outside the region or beyond a length."""
        kept = self.thinned(states)
        lengths = np.cumsum(np.linalg.norm(np.diff(states[kept], axis=0), axis=1))
        over = ~self.inside(states)
        over[kept[1:]] |= ~(lengths < remaining)
        return int(np.argmax(over)) + 1 if over.any() else len(states)

    def cut(self, states: Array, remaining: float, room: int) -> tuple[Array, ManifoldEnd]:
        """End a curve where it leaves the region, or at a length, whichever is first, by linear interpolation."""
        full = len(states) > room
        states = states[:room]
        outside = ~self.inside(states)
        if outside.any():
            end = int(np.argmax(outside))
            last = self._crossing(states[end - 1], states[end])
            states = np.concatenate([states[:end], last[np.isfinite(last).all(axis=1)]])
        lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(states, axis=0), axis=1))])
        if lengths[-1] >= remaining:
            end = int(np.searchsorted(lengths, remaining))
            fraction = (remaining - lengths[end - 1]) / (lengths[end] - lengths[end - 1])
            last = states[end - 1 : end] + fraction * (states[end] - states[end - 1])
            states = np.concatenate([states[:end], last])
        elif outside.any():
            return states, ManifoldEnd.LEAVES_REGION
        elif full:
            return states, ManifoldEnd.MOST_VERTICES
        return states, ManifoldEnd.ARC_LENGTH

    def _crossing(self, inner: Array, outer: Array) -> Array:
        """Where a chord leaves the widened region, shape (1, 2)."""
        start, step = (inner - self.low) / self.width, (outer - inner) / self.width
        with np.errstate(divide="ignore", invalid="ignore"):
            fractions = (np.where(step > 0, 1.0 + MARGIN, -MARGIN) - start) / step
        return (inner + np.min(np.where(step == 0, np.inf, fractions)) * (outer - inner))[None]

    def same(self, one: Array, other: Array) -> bool:
        """Whether two states are the same up to rounding."""
        return bool(np.linalg.norm((one - other) / self.width) < 1e-12)

    def thinned(self, states: Array) -> NDArray[np.intp]:
        """Indices of the states that suffice; the others lie where the curve is finer than necessary."""
        kept = np.arange(len(states))
        while len(kept) > 3:
            chords, angles = self.shape(states[kept])
            straight = np.concatenate([[True], angles <= 0.25 * self.bend, [True]])
            tiny = np.concatenate([[True], chords <= _FLOOR * self.spacing, [True]])
            both = chords[:-1] + chords[1:]
            spare = straight[:-2] & straight[1:-1] & straight[2:] & (both <= 0.5 * self.spacing)
            spare |= tiny[:-3] & tiny[1:-2] & tiny[2:-1] & tiny[3:] & (both <= _FLOOR * self.spacing)
            spare[1::2] = False
            if not spare.any():
                break
            kept = np.delete(kept, 1 + np.flatnonzero(spare))
        return kept


@dataclasses.dataclass(frozen=True, eq=False)
class Domain:
    """Fundamental domain, from `fraction` = 0 near the saddle to 1 at the image; the distance grows geometrically."""

    point: Array
    reach: Array
    growth: float
    mismatch: Array

    def __call__(self, fraction: Array) -> Array:
        along = self.growth ** (fraction[:, None] - 1.0) * self.reach
        return self.point + along + fraction[:, None] * self.mismatch

    @property
    def resolution(self) -> float:
        """Smallest difference of `fraction` that is not lost in rounding."""
        step = np.abs(self.reach).max() / self.growth * np.log(self.growth)
        return float(8.0 * np.finfo(float).eps * np.abs(self.point).max() / step) + 1e-12


class Growth:
    """A curve that grows by the images of a domain."""

    def __init__(self, domain: Domain, images: Images, limits: Limits) -> None:
        self.domain, self.images, self.limits = domain, images, limits
        self.fractions = np.linspace(0.0, 1.0, 5)  # in the domain, of the vertices of the last image
        self.states = domain(self.fractions)  # these vertices
        self.curve = [domain.point[None], self.states]  # the pieces so far
        self.left = limits.applications  # so often the map may still be applied to a state

    @np.errstate(invalid="ignore", over="ignore")  # motion that has left the region may be anywhere
    def run(self) -> tuple[Array, ManifoldEnd]:
        """Join images until the curve (count, 2) is long enough, leaves the region, or converges."""
        limits, curve = self.limits, self.curve
        if not limits.inside(np.concatenate(curve)).all():
            return self.domain.point[None], ManifoldEnd.SADDLE_OUTSIDE
        vertices, remaining = len(self.states), limits.arc_length - _length(np.concatenate(curve))
        if remaining <= 0.0:
            return limits.cut(np.concatenate(curve), limits.arc_length, _MOST_VERTICES)
        extent = 0.0
        for count in range(1, 5001):
            self._map(count, remaining)
            if self.left < 0:
                return np.concatenate(curve), ManifoldEnd.MOST_SECTIONS
            states, last = self.states, curve[-1][-1]
            joined = np.concatenate([last[None], states[limits.same(states[0], last) :]])
            room, whole = max(2, _MOST_VERTICES - vertices), self.fractions[-1] == 1.0 and limits.inside(states).all()
            if not whole or _length(joined) >= remaining or len(joined) > room:
                piece, end = limits.cut(joined, remaining, room)
                return np.concatenate([*curve, piece[1:]]), end
            curve.append(joined[1:])
            vertices, remaining = vertices + len(joined) - 1, remaining - _length(joined)
            before, extent = extent, float(limits.shape(joined)[0].sum())
            if extent < min(before, 1e-5):  # widths of the region: it converges to a point
                return np.concatenate(curve), ManifoldEnd.AT_REST
        return np.concatenate(curve), ManifoldEnd.TOO_SLOW

    def _map(self, count: int, remaining: float) -> None:
        """Go on to the image of a count, with as many vertices as make it fine enough, as far as it is needed.

        Every new vertex is an image of a point of the domain.
        """
        limits, before, fractions = self.limits, self.curve[-1][-2:-1], self.fractions
        states = self.images(self.states, 1)
        self.left -= len(states)
        while True:
            needed = limits.needed(states, 1.1 * remaining)
            fractions, states = fractions[:needed], states[:needed]
            coarse = limits.coarse(np.concatenate([before, states]))[1:]
            coarse &= np.diff(fractions) > self.domain.resolution
            self.left -= count * int(coarse.sum())
            if not coarse.any() or len(states) > _MOST_VERTICES or self.left < 0:
                break
            middle = 0.5 * (fractions[:-1] + fractions[1:])[coarse]
            places = 1 + np.flatnonzero(coarse)
            fractions = np.insert(fractions, places, middle)
            states = np.insert(states, places, self.images(self.domain(middle), count), axis=0)
        kept = limits.thinned(states)
        self.fractions, self.states = fractions[kept], states[kept]


def _length(states: Array) -> float:
    return float(np.linalg.norm(np.diff(states, axis=0), axis=1).sum())
