"""Cheapest in-trees: a path from every node to the root, of least total cost."""

from __future__ import annotations

import math

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
