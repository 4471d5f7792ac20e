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
    trees = (cheapest_tree(cost, root) for root in range(len(cost)))
    return np.array([math.inf if tree is None else math.fsum(cost[arc] for arc in tree.items()) for tree in trees])


def cheapest_tree(cost: Array, root: int) -> dict[int, int] | None:
    """Return the cheapest in-tree as the successor of each node except the root; None if there is no in-tree.

    Each node takes its cheapest arc. Where these arcs close a cycle, the cycle becomes one node, and an arc that
    leaves it costs what it adds to the cycle (Chu and Liu, Sci. Sinica 14, 1396, 1965; Edmonds, J. Res. NBS 71B, 233,
    1967).
    """
    open_cost = cost.astype(float)
    np.fill_diagonal(open_cost, math.inf)
    cheapest = open_cost.argmin(axis=1)
    arcs = {node: int(cheapest[node]) for node in range(len(cost)) if node != root}
    if not all(math.isfinite(open_cost[arc]) for arc in arcs.items()):
        return None
    cycle = cycle_of(arcs)
    return arcs if not cycle else _contracted(open_cost, root, arcs, cycle)


def cycle_of(arcs: dict[int, int]) -> list[int]:
    """Return the nodes of a cycle of arcs, at most one from each node; empty if there is no cycle."""
    done: set[int] = set()
    for start in arcs:
        visited: list[int] = []
        node = start
        while node in arcs and node not in done:
            done.add(node)
            visited.append(node)
            node = arcs[node]
        if node in visited:
            return visited[visited.index(node) :]
    return []


def _contracted(cost: Array, root: int, arcs: dict[int, int], cycle: list[int]) -> dict[int, int] | None:
    """Return the cheapest in-tree where the cheapest arcs close a cycle."""
    rest = [node for node in range(len(cost)) if node not in cycle]
    one = len(rest)  # number of the cycle in the smaller problem
    added = cost[np.ix_(cycle, rest)] - np.array([cost[node, arcs[node]] for node in cycle])[:, None]
    into = cost[np.ix_(rest, cycle)]
    smaller = np.full((one + 1, one + 1), math.inf)
    smaller[:one, :one] = cost[np.ix_(rest, rest)]
    smaller[one, :one] = added.min(axis=0)
    smaller[:one, one] = into.min(axis=1)
    tree = cheapest_tree(smaller, rest.index(root))
    if tree is None:
        return None
    whole = {node: arcs[node] for node in cycle}
    for node, successor in tree.items():
        if node == one:
            whole[cycle[int(added[:, successor].argmin())]] = rest[successor]
        else:
            whole[rest[node]] = cycle[int(into[node].argmin())] if successor == one else rest[successor]
    return whole
