"""Bounds of differences between cheapest trees, whose arcs are known between bounds only."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_CORNERS = 6  # widest entries that are taken at both their ends, in all combinations


def difference_bounds(
    lower: Array, upper: Array, first: Callable[[Array], Array], second: Callable[[Array], Array]
) -> tuple[Array, Array]:
    """Return bounds of first(V) − second(V) for all matrices V between two.

    Both are the least of sums of entries, each entry once at most: as one entry grows, first one of them grows with it
    and then both, so that their difference is monotone in each entry, and its extremes lie at corners of the box. The
    widest entries are taken corner by corner; of the others both ends are taken at once, which is a bound, and no more
    than that.

    Parameters
    ----------
    lower, upper : array (count, count)
    first, second : callable
        From a matrix to arrays of one shape.

    Returns
    -------
    (array, array)
    """
    with np.errstate(invalid="ignore"):
        width = np.where(lower == upper, 0.0, upper - lower)
    order = np.argsort(width, axis=None)[::-1][:_CORNERS]
    widest = [np.unravel_index(place, width.shape) for place in order if width.flat[place] > 0]
    lows, highs = [], []
    for ends in itertools.product((lower, upper), repeat=len(widest)):
        low, high = lower.copy(), upper.copy()
        for place, end in zip(widest, ends, strict=True):
            low[place] = high[place] = end[place]
        one, other = first(low), second(low)
        same = bool((low == high).all())
        one_high, other_high = (one, other) if same else (first(high), second(high))
        lows.append(_difference(one, other_high, -np.inf))
        highs.append(_difference(one_high, other, np.inf))
    return np.min(lows, axis=0), np.max(highs, axis=0)


def _difference(one: Array, other: Array, unknown: float) -> Array:
    """One less other; `unknown` where both are infinite."""
    with np.errstate(invalid="ignore"):
        return np.where(np.isinf(one) & np.isinf(other), unknown, one - other)
