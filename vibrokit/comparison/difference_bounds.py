"""Bounds of differences between least sums of energies that are known only within bounds."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_CORNERS = 6  # widest entries whose ends are combined, so that 2⁶ matrices are evaluated
_FEW = 12  # attractors up to which this takes seconds at most


def difference_bounds(lower: Array, upper: Array, both: Callable[[Array], tuple[Array, Array]]) -> tuple[Array, Array]:
    """Return bounds of first(V) − second(V) for all matrices V with lower ≤ V ≤ upper.

    Both functions are the least of sums in which each entry occurs at most once. As one entry grows, both functions
    grow with it, then only one of them, then neither. Their difference is therefore monotone in each entry, and its
    extremes lie at corners of the box. Of a few attractors, the ends of the widest entries are combined exactly. The
    other entries are set to opposite ends in the two functions, which gives a bound that need not be attained.

    `both` makes of a matrix the values of the two functions, arrays of one shape.
    """
    width = np.subtract(upper, lower, where=lower != upper, out=np.zeros_like(upper))
    order = np.argsort(width, axis=None)[::-1][: _CORNERS if len(lower) <= _FEW else 0]
    widest = [np.unravel_index(place, width.shape) for place in order if width.flat[place] > 0]
    lows, highs = [], []
    for ends in itertools.product((lower, upper), repeat=len(widest)):
        low, high = lower.copy(), upper.copy()
        for place, end in zip(widest, ends, strict=True):
            low[place] = high[place] = end[place]
        (first_low, second_low), (first_high, second_high) = both(low), both(high)
        lows.append(_difference(first_low, second_high, -np.inf))
        highs.append(_difference(first_high, second_low, np.inf))
    return np.min(lows, axis=0), np.max(highs, axis=0)


def _difference(one: Array, other: Array, unknown: float) -> Array:
    """Return one − other; `unknown` where both are infinite."""
    both = np.isinf(one) & np.isinf(other)
    return np.subtract(one, other, where=~both, out=np.full(np.shape(one), unknown))
