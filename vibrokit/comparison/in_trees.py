"""Least sums of energies: the cheapest in-trees, and bounds of differences of such sums."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def tree_costs(cost: Array) -> Array:
    """Return the cost of the cheapest in-tree of each root; infinite where some node has no path to the root.

    `cost` (count, count) has the cost of the arc from row to column, not negative, infinite where there is no arc. The
    diagonal is ignored.
    """
    return np.array([_tree_cost(cost, root) for root in range(len(cost))])


def _tree_cost(cost: Array, root: int) -> float:
    """The cost of one tree, by eliminating node after node.

    The weight of a root in a Markov chain is the sum over its in-trees, and elimination without subtractions gives it,
    as in `vibrokit.comparison.markov_chain`. For rates exp(−cost/D) and D → 0, sums become minima, products sums.
    """
    order = [root, *(node for node in range(len(cost)) if node != root)]
    arcs = cost[np.ix_(order, order)].astype(float)
    taken: list[float] = []
    for k in range(len(order) - 1, 0, -1):
        cheapest = float(arcs[k, :k].min())
        if math.isinf(cheapest):
            return math.inf
        taken.append(cheapest)
        arcs[:k, :k] = np.minimum(arcs[:k, :k], arcs[:k, k, None] + (arcs[k, :k] - cheapest))
    return math.fsum(taken)


def difference_bounds(lower: Array, upper: Array, both: Callable[[Array], tuple[Array, Array]]) -> tuple[Array, Array]:
    """Return bounds of first(V) − second(V) for all matrices V with lower ≤ V ≤ upper.

    Both functions are the least of sums in which each entry occurs at most once. As one entry grows, both functions
    grow with it, then only one of them, then neither. Their difference is therefore monotone in each entry, and its
    extremes lie at corners of the box. Of a few attractors, the ends of the widest entries are combined exactly. The
    other entries are set to opposite ends in the two functions, which gives a bound that need not be attained.

    `both` makes of a matrix the values of the two functions, arrays of one shape.
    """
    width = np.subtract(upper, lower, where=lower != upper, out=np.zeros_like(upper))
    # Up to 2⁶ matrices of at most 12 attractors, which takes seconds.
    order = np.argsort(width, axis=None)[::-1][: 6 if len(lower) <= 12 else 0]
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
