"""The hierarchy of cycles: which attractors, and groups of attractors, are left on which time scale."""

from __future__ import annotations

import dataclasses
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from vibrokit.comparison.in_trees import difference_bounds, tree_costs
from vibrokit.documented import documented

Array = NDArray[np.float64]


@documented
@dataclasses.dataclass(frozen=True)
class Cycle:
    """An attractor, or a group of attractors among which the motion cycles, and how it is left.

    The mean time until then grows like exp(energy/D).
    """

    members: Annotated[tuple[int, ...], "labels of the attractors"]
    source: Annotated[int, "label of the member from which it is left"]
    target: Annotated[int, "label of the attractor that is reached"]
    energy: Annotated[float, "energy", "m2 s-3"]
    lower: Annotated[float, "lower bound of the energy, from those of the activation energies", "m2 s-3"]
    upper: Annotated[float, "upper bound of the energy", "m2 s-3"]


def cycle_hierarchy(energies: Array, lower: Array, upper: Array) -> tuple[Cycle, ...]:
    """Return the cycles by ascending energy, each after those that it contains.

    The cheapest exit of each attractor leads to another one. Where these exits close a cycle, its attractors become a
    group. The group is left, from member i to an outsider j, at E_i + V_ij, where E_i is the exponent of the weight of
    i within the group (Freidlin and Wentzell, chapter 6, section 6: the hierarchy of cycles).

    The matrices are those of `vibrokit.comparison.transitions.Transitions`.
    """
    groups: list[tuple[int, ...]] = [(label,) for label in range(len(energies))]
    found: dict[tuple[int, ...], Cycle] = {}
    while len(groups) > 1:
        found |= {group: _left(group, energies, lower, upper) for group in groups if group not in found}
        home = {label: place for place, group in enumerate(groups) for label in group}
        exits = {place: found[group] for place, group in enumerate(groups) if np.isfinite(found[group].energy)}
        closed = _cycle_of({place: home[cycle.target] for place, cycle in exits.items()})
        if not closed:
            break
        joined = tuple(sorted(label for place in closed for label in groups[place]))
        groups = [group for place, group in enumerate(groups) if place not in closed] + [joined]
    known = [cycle for cycle in found.values() if np.isfinite(cycle.energy)]

    def rank(cycle: Cycle) -> float:
        return max(inner.energy for inner in known if set(inner.members) <= set(cycle.members))

    return tuple(sorted(known, key=rank))  # not by energy alone: rounding must not put a group before its members


def _cycle_of(arcs: dict[int, int]) -> list[int]:
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


def _left(group: tuple[int, ...], energies: Array, lower: Array, upper: Array) -> Cycle:
    """Return how a group is left; its energy is infinite where no exit is known."""
    inside = list(group)
    outside = [label for label in range(len(energies)) if label not in group]

    def exits(cost: Array) -> tuple[Array, Array]:
        weights = tree_costs(cost[np.ix_(inside, inside)])
        return weights[:, None] + cost[np.ix_(inside, outside)], weights

    def least(cost: Array) -> tuple[Array, Array]:
        costs, weights = exits(cost)
        return costs.min(), weights.min()

    costs, weights = exits(energies)
    member, beyond = np.unravel_index(int(costs.argmin()), costs.shape)
    low, high = difference_bounds(lower, upper, least)
    value = float(costs.min() - weights.min())
    return Cycle(group, inside[int(member)], outside[int(beyond)], value, float(low), float(high))
