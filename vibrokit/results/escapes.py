"""Escapes: in which order attractors, and groups of them, are left as time goes on."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vibrokit.results.brackets import difference_bounds
from vibrokit.results.in_trees import cycle_of, tree_cost

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True)
class Escape:
    """How an attractor is left, or a group of attractors between which the motion goes to and fro.

    Attributes
    ----------
    members : tuple of int
        Labels of what is left.
    source, target : int
        Labels of the member that it is left from, and of the attractor that is reached.
    energy : float
        The mean time until then grows like exp(energy/D) (m² s⁻³).
    lower, upper : float
        Bounds that follow from those of the energies.
    """

    members: tuple[int, ...]
    source: int
    target: int
    energy: float
    lower: float
    upper: float

    def __str__(self) -> str:
        bounds = "" if self.upper - self.lower <= 1e-4 * self.energy else f" ({self.lower:.3g}–{self.upper:.3g})"
        if len(self.members) == 1:
            return f"attractor {self.source} is left for {self.target} at {self.energy:.5g}{bounds}"
        group = ", ".join(map(str, self.members))
        return f"the group {group} is left from {self.source} for {self.target} at {self.energy:.5g}{bounds}"


def escapes(labels: Sequence[int], energies: Array, lower: Array, upper: Array) -> tuple[Escape, ...]:
    """Return the escapes by ascending energy, that of a group after those of its members.

    Each attractor goes to where its cheapest exit leads. Where that closes a cycle, its attractors become a group,
    which is left, from member i for an outsider j, at E_i + V_ij; E_i is the exponent of i's weight within the group
    (Freidlin and Wentzell, chapter 6, section 6: the hierarchy of cycles).

    Parameters
    ----------
    labels : sequence of int
        Of rows and columns.
    energies, lower, upper : array (count, count)
        As in `vibrokit.results.transitions.Transitions`.
    """
    groups: list[tuple[int, ...]] = [(index,) for index in range(len(labels))]
    found: list[tuple[float, Escape]] = []
    exits: dict[tuple[int, ...], tuple[int, int]] = {}
    while len(groups) > 1:
        for group in groups:
            if group not in exits:
                escape, way = _escape(labels, group, energies, lower, upper)
                if way is not None:
                    exits[group] = way
                    found.append((max([escape.energy, *_inner(found, escape)]), escape))
        home = {node: place for place, group in enumerate(groups) for node in group}
        cycle = cycle_of({home[group[0]]: home[exits[group][1]] for group in groups if group in exits})
        if not cycle:
            break
        joined = tuple(sorted(node for place in cycle for node in groups[place]))
        groups = [group for place, group in enumerate(groups) if place not in cycle] + [joined]
    return tuple(escape for _, escape in sorted(found, key=lambda pair: pair[0]))


def _inner(found: list[tuple[float, Escape]], escape: Escape) -> list[float]:
    """Energies of the escapes within a group: rounding must not put the group before them."""
    return [energy for energy, inner in found if set(inner.members) < set(escape.members)]


def _escape(
    labels: Sequence[int], group: tuple[int, ...], energies: Array, lower: Array, upper: Array
) -> tuple[Escape, tuple[int, int] | None]:
    inside = list(group)
    outside = [node for node in range(len(labels)) if node not in group]

    def rest(cost: Array) -> Array:
        own = cost[np.ix_(inside, inside)]
        return np.array([tree_cost(own, root) for root in range(len(inside))])

    def ways(cost: Array) -> Array:
        return rest(cost)[:, None] + cost[np.ix_(inside, outside)]

    costs = ways(energies)
    member, beyond = np.unravel_index(int(costs.argmin()), costs.shape)
    value = float(costs.min() - rest(energies).min())
    low, high = difference_bounds(lower, upper, lambda cost: ways(cost).min(), lambda cost: rest(cost).min())
    source, target = inside[int(member)], outside[int(beyond)]
    escape = Escape(
        tuple(labels[node] for node in group), labels[source], labels[target], value, float(low), float(high)
    )
    return escape, (source, target) if np.isfinite(value) else None
