"""Cheapest in-trees: from every node a way to the root, with the least cost of all arcs together."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def tree_cost(cost: Array, root: int) -> float:
    """Return what the cheapest in-tree costs; infinite where some node has no way to the root.

    Parameters
    ----------
    cost : array (count, count)
        Cost of the arc from row to column, not negative, infinite where there is none; the diagonal is not looked at.
    root : int
    """
    tree = cheapest_tree(cost, root)
    return math.inf if tree is None else math.fsum(float(cost[arc]) for arc in tree.items())


def cheapest_tree(cost: Array, root: int) -> dict[int, int] | None:
    """Return the cheapest in-tree as the node that each node but the root goes to; None if there is none.

    Each node takes its cheapest arc; where these close a cycle it is made one node, its arcs priced by what is lost in
    leaving the cycle there (Chu and Liu, Sci. Sinica 14, 1396, 1965; Edmonds, J. Res. NBS 71B, 233, 1967).
    """
    open_cost = cost.astype(float)
    np.fill_diagonal(open_cost, math.inf)
    nearest = open_cost.argmin(axis=1)
    arcs = {node: int(nearest[node]) for node in range(len(cost)) if node != root}
    if not all(math.isfinite(open_cost[arc]) for arc in arcs.items()):
        return None
    cycle = cycle_of(arcs)
    return arcs if not cycle else _through(open_cost, root, arcs, cycle)


def cycle_of(arcs: dict[int, int]) -> list[int]:
    """Return the nodes of a cycle of the arcs, each node with one at most; empty if there is none."""
    done: set[int] = set()
    for start in arcs:
        way: dict[int, None] = {}  # in the order of the visits
        node = start
        while node in arcs and node not in done and node not in way:
            way[node] = None
            node = arcs[node]
        if node in way:
            visited = list(way)
            return visited[visited.index(node) :]
        done.update(way)
    return []


def _through(cost: Array, root: int, arcs: dict[int, int], cycle: list[int]) -> dict[int, int] | None:
    """The cheapest in-tree where the cheapest arcs close a cycle."""
    rest = [node for node in range(len(cost)) if node not in cycle]
    one = len(rest)  # the cycle's number in the smaller problem
    loss = cost[np.ix_(cycle, rest)] - np.array([cost[node, arcs[node]] for node in cycle])[:, None]
    into = cost[np.ix_(rest, cycle)]
    smaller = np.full((one + 1, one + 1), math.inf)
    smaller[:one, :one] = cost[np.ix_(rest, rest)]
    smaller[one, :one] = loss.min(axis=0)
    smaller[:one, one] = into.min(axis=1)
    tree = cheapest_tree(smaller, rest.index(root))
    if tree is None:
        return None
    whole = {node: arcs[node] for node in cycle}
    for node, towards in tree.items():
        if node == one:
            whole[cycle[int(loss[:, towards].argmin())]] = rest[towards]
        else:
            whole[rest[node]] = cycle[int(into[node].argmin())] if towards == one else rest[towards]
    return whole
