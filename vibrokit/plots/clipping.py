"""Cuts curves at the edges of a rectangle."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def clipped(curve: ArrayLike, bounds: ArrayLike) -> Array:
    """Return the parts of a curve that lie in a rectangle, cut at its edges, with a row of NaN between parts.

    Each segment p + s·d, 0 ≤ s ≤ 1, is cut to the s at which it is between all four edges (Liang and Barsky, ACM Trans.
    Graph. 3, 1, 1984). Segments with an end that is NaN or infinite are left out.
    """
    points, box = np.asarray(curve, dtype=float).reshape(-1, 2), np.asarray(bounds, dtype=float)
    if len(points) == 0 or np.all((box[:, 0] <= points) & (points <= box[:, 1])):
        return points
    starts, ends = points[:-1], points[1:]
    sound = np.isfinite(starts).all(axis=1) & np.isfinite(ends).all(axis=1)
    starts, ends = starts[sound], ends[sound]
    follows = np.diff(np.flatnonzero(sound), prepend=-2) == 1  # whether a segment begins where the one before ends
    enter, leave = _inside(starts, ends - starts, box)
    kept = np.flatnonzero(enter <= leave)
    pieces: list[Array] = []
    previous = -2
    for k in kept.tolist():
        joined = previous == k - 1 and follows[k] and enter[k] == 0.0 and leave[k - 1] == 1.0
        if not joined:
            pieces += [np.full(2, np.nan)] if pieces else []
            pieces.append(_at(starts[k], ends[k], enter[k], box))
        pieces.append(_at(starts[k], ends[k], leave[k], box))
        previous = k
    return np.array(pieces).reshape(-1, 2)


def _inside(starts: Array, steps: Array, box: Array) -> tuple[Array, Array]:
    """Share of each segment at which it enters the box, and at which it leaves it."""
    with np.errstate(divide="ignore", invalid="ignore"):
        cuts = (box.T[None] - starts[:, None]) / steps[:, None]  # (segments, edge, axis)
    still = steps == 0.0  # along an edge's direction: in between for good, or never
    between = (box[:, 0] <= starts) & (starts <= box[:, 1])
    first = np.where(still, np.where(between, 0.0, np.inf), cuts.min(axis=1))
    last = np.where(still, np.where(between, 1.0, -np.inf), cuts.max(axis=1))
    return np.maximum(first.max(axis=1), 0.0), np.minimum(last.min(axis=1), 1.0)


def _at(start: Array, end: Array, share: float, box: Array) -> Array:
    if share == 0.0:
        return start
    if share == 1.0:
        return end
    return np.clip(start + share * (end - start), box[:, 0], box[:, 1])  # rounding leaves the box by one bit
