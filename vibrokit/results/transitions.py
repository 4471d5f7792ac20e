"""Transitions: what it costs to go from each attractor to each other, and what follows for weak noise."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import StructureError
from vibrokit.results.brackets import difference_bounds
from vibrokit.results.energy import ActivationEnergy
from vibrokit.results.escapes import Escape, escapes
from vibrokit.results.in_trees import tree_cost
from vibrokit.results.stationary import StationaryWeights

Array = NDArray[np.float64]

MOST_ATTRACTORS = 200


@dataclasses.dataclass(frozen=True, eq=False)
class Transitions:
    """Activation energies between all attractors, and the long run of weak noise that follows from them.

    For D → 0 the motion jumps between attractors, from i to j at rates like exp(−V_ij/D), and rests in the end on
    attractor i with a weight like exp(−(W_i − min W)/D). W_i is the least sum of V over the graphs that lead from every
    other attractor to i (Freidlin and Wentzell, Random Perturbations of Dynamical Systems, 3rd ed., Springer 2012,
    chapter 6). Both are exponents only: factors that do not depend on D exponentially are not known here.

    Attributes
    ----------
    labels : tuple of int
        Of the attractors, in the order of rows and columns.
    energies : array (count, count)
        Least activation energy V_ij of a direct exit from row i to column j (m² s⁻³); infinite where none was found,
        0 on the diagonal.
    lower, upper : array (count, count)
        Bounds of each, infinite where none was found.

    Raises
    ------
    StructureError
        Labels are doubled, arrays are of another shape, or the bounds are no bounds.
    """

    labels: tuple[int, ...]
    energies: Array
    lower: Array
    upper: Array

    def __post_init__(self) -> None:
        count = len(self.labels)
        if len(set(self.labels)) != count or count > MOST_ATTRACTORS:
            raise StructureError(
                f"transitions have {count} labels, {len(set(self.labels))} of them different; give different ones, "
                f"at most {MOST_ATTRACTORS}."
            )
        for name in ("energies", "lower", "upper"):
            shape = np.shape(getattr(self, name))
            if shape != (count, count):
                raise StructureError(f"transitions of {count} attractors have {name} of shape {shape}.")
        if not np.all((self.lower >= 0) & (self.lower <= self.energies) & (self.energies <= self.upper)):
            raise StructureError("transitions need 0 ≤ lower ≤ energies ≤ upper, and no NaN.")

    @classmethod
    def of(cls, labels: Sequence[int], energies: Iterable[ActivationEnergy]) -> Transitions:
        """Collect energies, the least of each pair; those between other labels are left out.

        Parameters
        ----------
        labels : sequence of int
            Of all attractors, also of those that no exit was found from.
        energies : iterable of ActivationEnergy
        """
        place = {label: index for index, label in enumerate(labels)}
        matrices = [np.full((len(place), len(place)), np.inf) for _ in range(3)]
        for matrix in matrices:
            np.fill_diagonal(matrix, 0.0)
        for energy in energies:
            if energy.source in place and energy.target in place:
                at = place[energy.source], place[energy.target]
                for matrix, value in zip(matrices, (energy.value, energy.lower, energy.upper), strict=True):
                    matrix[at] = min(matrix[at], value)
        return cls(tuple(labels), *matrices)

    @property
    def not_left(self) -> tuple[int, ...]:
        """Labels of the attractors that no exit was found from."""
        exits = np.isfinite(self.energies) & ~np.eye(len(self.labels), dtype=bool)
        rows = zip(self.labels, exits, strict=True)
        return tuple(label for label, row in rows if not row.any()) if len(self.labels) > 1 else ()

    @cached_property
    def known(self) -> bool:
        """Whether weights follow: each attractor is left, and one at least is reached from all others."""
        return bool(self.labels) and not self.not_left and bool(np.isfinite(_tree_costs(self.energies)).any())

    @cached_property
    def weights(self) -> Array:
        """Exponents W_i − min W of the stationary weights (m² s⁻³), 0 for the most stable; NaN where not known.

        Infinite for an attractor that no way was found into.
        """
        if not self.known:
            return np.full(len(self.labels), np.nan)
        costs = _tree_costs(self.energies)
        return costs - costs.min()

    @property
    def weight_bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds of `weights`, for all energies within their bounds."""
        if not self.known:
            return self.weights, self.weights
        low, high = self._differences
        return np.maximum(low.max(axis=1), 0.0), np.maximum(high.max(axis=1), 0.0)

    @property
    def most_stable(self) -> int | None:
        """Label of the attractor of the largest weight; None where that is not known, or undecided within bounds."""
        leading = self.leading
        return leading[0] if len(leading) == 1 else None

    @property
    def leading(self) -> tuple[int, ...]:
        """Labels of those that may be the most stable, within the bounds; none where nothing is known."""
        if not self.known:
            return ()
        low, _ = self._differences
        return tuple(label for label, row in zip(self.labels, low, strict=True) if row.max() <= 0)

    @cached_property
    def order_of_escapes(self) -> tuple[Escape, ...]:
        """Escapes from attractors and from groups of them between which the motion goes to and fro, the first first."""
        return escapes(self.labels, self.energies, self.lower, self.upper)

    @cached_property
    def quasi_potentials(self) -> Array:
        """Cheapest ways from row to column, through other attractors too (m² s⁻³); shape of `energies`."""
        cost = self.energies.copy()
        np.fill_diagonal(cost, 0.0)
        for between in range(len(cost)):  # Floyd, Comm. ACM 5, 345 (1962)
            cost = np.minimum(cost, cost[:, between, None] + cost[None, between])
        return cost

    def route(self, source: int, target: int) -> tuple[int, ...]:
        """Return the labels on the cheapest way, both ends included; empty if there is no way.

        Raises
        ------
        StructureError
            There is no attractor of a label.
        """
        for label in (source, target):
            if label not in self.labels:
                known = ", ".join(map(str, self.labels))
                raise StructureError(f"there is no attractor of label {label!r}; there are {known}.")
        here, end = self.labels.index(source), self.labels.index(target)
        cost = {here: 0.0}
        before: dict[int, int] = {}
        waiting = set(range(len(self.labels)))
        while here != end and math.isfinite(cost.get(here, math.inf)):  # Dijkstra: steps of cost 0 close no circle
            waiting.discard(here)
            for node in waiting:
                way = cost[here] + float(self.energies[here, node])
                if way < cost.get(node, math.inf):
                    cost[node], before[node] = way, here
            here = min(waiting, key=lambda node: cost.get(node, math.inf))
        if here != end or end not in cost:
            return ()
        way_back = [end]
        while way_back[-1] in before:
            way_back.append(before[way_back[-1]])
        return tuple(self.labels[node] for node in reversed(way_back))

    def stationary_weights(self, intensity: float) -> StationaryWeights:
        """Return the stationary weights at a noise intensity D (m² s⁻³), by their exponents alone.

        Raises
        ------
        StructureError
            The intensity is not positive.
        """
        if not (math.isfinite(intensity) and intensity > 0):
            raise StructureError(f"the noise intensity is {intensity!r}; give a positive, finite one.")
        if not self.known:
            return StationaryWeights(self.labels, intensity, self.weights, self.weights, self.weights)
        low, high = self._differences
        with np.errstate(invalid="ignore", over="ignore"):
            value = self.weights[:, None] - self.weights[None]
            value[np.isnan(value)] = 0.0  # of two that no way was found into
            shares = [_share(differences / intensity) for differences in (value, high, low)]
        return StationaryWeights(self.labels, intensity, *shares)

    @property
    def verdict(self) -> str:
        """Which attractor is the most stable in the long run, or why that is not known, as a sentence."""
        if not self.labels:
            return "There is no attractor."
        if self.not_left:
            return f"No exit was found from {_listed(self.not_left)}, so what is most stable does not follow."
        if not self.known:
            return "No attractor was found to be reached from all others, so what is most stable does not follow."
        lost = [label for label, weight in zip(self.labels, self.weights, strict=True) if math.isinf(weight)]
        rest = f" No way was found into {_listed(lost)}: weight 0." if lost else ""
        if self.most_stable is not None:
            return f"The most stable is attractor {self.most_stable}.{rest}"
        return f"The most stable is undecided between {_listed(self.leading)}: their bounds overlap.{rest}"

    def __str__(self) -> str:
        heads = ["from \\ to", *map(str, self.labels)]
        rows = [
            [str(label), *("–" if i == j else _shown(v, a, b) for j, (v, a, b) in enumerate(zip(*row, strict=True)))]
            for i, (label, *row) in enumerate(zip(self.labels, self.energies, self.lower, self.upper, strict=True))
        ]
        low, high = self.weight_bounds
        weights = [
            f"{label}: {_shown(*three)}" for label, *three in zip(self.labels, self.weights, low, high, strict=True)
        ]
        order = [f"  {escape}" for escape in self.order_of_escapes]
        last = [f"Weights go like exp(−(W − min W)/D), W − min W being {', '.join(weights)}."] if self.known else []
        return "\n".join(
            [*_aligned([heads, *rows]), "", self.verdict, *(["Order of escapes:", *order] if order else []), *last]
        )

    @cached_property
    def _differences(self) -> tuple[Array, Array]:
        """Bounds of W_i − W_j, shape (count, count) each, 0 on the diagonal."""
        shape = (len(self.labels),) * 2
        low, high = difference_bounds(
            self.lower,
            self.upper,
            lambda energies: np.broadcast_to(_tree_costs(energies)[:, None], shape),
            lambda energies: np.broadcast_to(_tree_costs(energies)[None], shape),
        )
        for bound in (low, high):
            np.fill_diagonal(bound, 0.0)
        return low, high


def _tree_costs(energies: Array) -> Array:
    return np.array([tree_cost(energies, root) for root in range(len(energies))])


def _share(differences: Array) -> Array:
    """1 / Σ_j exp(E_i − E_j) of differences E_i − E_j."""
    return np.exp(-np.logaddexp.reduce(differences, axis=1))


def _listed(labels: Sequence[int]) -> str:
    return f"attractor{'s' if len(labels) > 1 else ''} {', '.join(map(str, labels))}"


def _shown(value: float, lower: float, upper: float) -> str:
    """A number, with its bounds where these are further apart than its digits show."""
    if not math.isfinite(value) or upper - lower <= 1e-4 * abs(value):
        return f"{value:.5g}"
    return f"{value:.4g} ({lower:.3g}–{upper:.3g})"


def _aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return ["  ".join(f"{text:<{width}}" for text, width in zip(row, widths, strict=True)).rstrip() for row in rows]
