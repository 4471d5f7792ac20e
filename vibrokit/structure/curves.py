"""Curves grown as images of a short piece, with a bound on their chords and on how sharply they turn."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

MARGIN = 1.0
"""How much of its own width and height a region is widened by, on every side, before a curve counts as outside."""

_FLOOR = 0.01  # shortest chord that is still divided because it turns, in units of the spacing
_REST = 1e-5  # length of an image below which a curve has come to rest, as a share of the region
_SEEDS = 5
_THINNING = 1.1  # a curve is at most this much longer than what is left of it when it is thinned
_MOST_NODES, _MOST_IMAGES = 100_000, 5000

Array = NDArray[np.float64]
Images = Callable[[Array, int], Array]
"""Images of states (count, 2) under a number of applications of a map; NaN where they ran out of range."""


@dataclasses.dataclass(frozen=True, eq=False)
class Limits:
    """How fine a curve must be, and where it ends; distances in units of the region's width and height."""

    low: Array
    width: Array
    spacing: float
    bend: float
    arc_length: float

    def inside(self, states: Array) -> NDArray[np.bool_]:
        """Whether states lie in the widened region; NaN does not."""
        place = (states - self.low) / self.width
        return np.asarray(((place >= -MARGIN) & (place <= 1.0 + MARGIN)).all(axis=1))

    def shape(self, states: Array) -> tuple[Array, Array]:
        """Length of each chord, and the angle by which the next one turns away from it."""
        steps = np.diff(states / self.width, axis=0)
        cross = steps[:-1, 0] * steps[1:, 1] - steps[:-1, 1] * steps[1:, 0]
        return np.linalg.norm(steps, axis=1), np.abs(np.arctan2(cross, (steps[:-1] * steps[1:]).sum(axis=1)))

    def coarse(self, states: Array) -> NDArray[np.bool_]:
        """Which chords must be divided."""
        with np.errstate(invalid="ignore"):
            chords, angles = self.shape(states)
        longer = np.maximum(chords[:-1], chords[1:])
        sharp = (angles > self.bend) | (longer * angles > 0.5 * self.spacing * self.bend)
        turning = np.zeros(len(chords), dtype=bool)
        turning[:-1] |= sharp
        turning[1:] |= sharp
        return ~(chords <= self.spacing) | (turning & (chords > _FLOOR * self.spacing))

    def needed(self, states: Array, left: float) -> int:
        """How many of an image's states matter: those up to the first outside the region or beyond a length."""
        kept = self.thinned(states)
        lengths = np.cumsum(np.linalg.norm(np.diff(states[kept], axis=0), axis=1))
        over = ~self.inside(states)
        over[kept[1:]] |= ~(lengths < left)
        return int(np.argmax(over)) + 1 if over.any() else len(states)

    def cut(self, states: Array, left: float, room: int) -> tuple[Array, str]:
        """End a curve where it leaves the region, or at a length, whichever comes first, by linear interpolation."""
        full = len(states) > room
        states = states[:room]
        outside = ~self.inside(states)
        if outside.any():
            end = int(np.argmax(outside))
            last = self._crossing(states[end - 1], states[end])
            states = np.concatenate([states[:end], last[np.isfinite(last).all(axis=1)]])
        lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(states, axis=0), axis=1))])
        if lengths[-1] >= left:
            end = int(np.searchsorted(lengths, left))
            share = (left - lengths[end - 1]) / (lengths[end] - lengths[end - 1])
            last = states[end - 1 : end] + share * (states[end] - states[end - 1])
            states = np.concatenate([states[:end], last])
        elif outside.any():
            return states, f"It leaves the region, widened by its own size on every side, at {_place(states[-1])}."
        elif full:
            return states, f"It was cut at {_MOST_NODES} points, the most that are kept; give a larger spacing or bend."
        return states, f"It was cut at its arc length of {self.arc_length:.6g}."

    def _crossing(self, inner: Array, outer: Array) -> Array:
        """Where a chord leaves the widened region, shape (1, 2)."""
        start, step = (inner - self.low) / self.width, (outer - inner) / self.width
        with np.errstate(divide="ignore", invalid="ignore"):
            shares = (np.where(step > 0, 1.0 + MARGIN, -MARGIN) - start) / step
        return (inner + np.min(np.where(step == 0, np.inf, shares)) * (outer - inner))[None]

    def same(self, one: Array, other: Array) -> bool:
        """Whether two states are one, but for rounding."""
        return bool(np.linalg.norm((one - other) / self.width) < 1e-12)

    def thinned(self, states: Array) -> NDArray[np.intp]:
        """Which states suffice: the rest stands where the curve is finer than it need be."""
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
    """Fundamental domain: from `share` = 0 near the saddle, by equal factors of the distance, to 1 at the image."""

    point: Array
    reach: Array
    growth: float
    mismatch: Array

    def __call__(self, share: Array) -> Array:
        along = self.growth ** (share[:, None] - 1.0) * self.reach
        return self.point + along + share[:, None] * self.mismatch

    @property
    def resolution(self) -> float:
        """Least difference of `share` that rounding leaves meaningful."""
        step = np.abs(self.reach).max() / self.growth * np.log(self.growth)
        return float(8.0 * np.finfo(float).eps * np.abs(self.point).max() / step) + 1e-12


def grow(domain: Domain, images: Images, limits: Limits) -> tuple[Array, str]:
    """Join the images of a domain to a curve until it is long enough, leaves the region, or comes to rest.

    Returns
    -------
    curve : array (count, 2)
    status : str
        Why it ends, as a sentence.
    """
    shares = np.linspace(0.0, 1.0, _SEEDS)
    states = domain(shares)
    curve = [domain.point[None], states]
    if not limits.inside(np.concatenate(curve)).all():
        return domain.point[None], "Its saddle lies outside the region, widened by its own size on every side."
    nodes, left = len(states), limits.arc_length - _length(np.concatenate(curve))
    if left <= 0.0:
        return limits.cut(np.concatenate(curve), limits.arc_length, _MOST_NODES)
    extent = 0.0
    for count in range(1, _MOST_IMAGES + 1):
        before = curve[-1][-2]
        shares, states = _image(domain, images, count, (shares, images(states, 1)), before, left, limits)
        kept = limits.thinned(states)
        shares, states = shares[kept], states[kept]
        joined = np.concatenate([curve[-1][-1:], states[limits.same(states[0], curve[-1][-1]) :]])
        room = max(2, _MOST_NODES - nodes)
        if shares[-1] < 1.0 or not limits.inside(states).all() or _length(joined) >= left or len(joined) > room:
            piece, status = limits.cut(joined, left, room)
            return np.concatenate([*curve, piece[1:]]), status
        curve.append(joined[1:])
        nodes, left = nodes + len(joined) - 1, left - _length(joined)
        last, extent = extent, float(limits.shape(joined)[0].sum())
        if extent < min(last, _REST):
            return np.concatenate(curve), f"It comes to rest at {_place(states[-1])}."
    status = f"It was given up after {_MOST_IMAGES} images, at {_place(states[-1])}: it moves too slowly."
    return np.concatenate(curve), status


def _image(
    domain: Domain,
    images: Images,
    count: int,
    nodes: tuple[Array, Array],
    before: Array,
    left: float,
    limits: Limits,
) -> tuple[Array, Array]:
    """Insert nodes into an image of the domain until it is fine enough, as far as it is needed.

    Every new node is carried from the domain itself; `before` is the point of the curve before the image begins.
    """
    shares, states = nodes
    while True:
        needed = limits.needed(states, _THINNING * left)
        shares, states = shares[:needed], states[:needed]
        coarse = limits.coarse(np.concatenate([before[None], states]))[1:] & (np.diff(shares) > domain.resolution)
        if not coarse.any() or len(states) > _MOST_NODES:
            return shares, states
        middle = 0.5 * (shares[:-1] + shares[1:])[coarse]
        places = 1 + np.flatnonzero(coarse)
        shares = np.insert(shares, places, middle)
        states = np.insert(states, places, images(domain(middle), count), axis=0)


def _length(states: Array) -> float:
    return float(np.linalg.norm(np.diff(states, axis=0), axis=1).sum())


def _place(state: Array) -> str:
    return f"x = {state[0]:.6g}, v = {state[1]:.6g}"
