"""Transitions: activation energies between all attractors, and what follows from them for weak noise."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from functools import cached_property
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import csgraph_from_dense, dijkstra

from vibrokit.comparison.cycles import Cycle, cycle_hierarchy
from vibrokit.comparison.in_trees import difference_bounds, tree_costs
from vibrokit.construction import Constructed, called
from vibrokit.documented import documented
from vibrokit.errors import StructureError, shown
from vibrokit.results.labels import exit_between, label_of
from vibrokit.results.one_scene import per_unit_mass
from vibrokit.results.result import Result
from vibrokit.text_table import text_table

Array = NDArray[np.float64]


@documented
@dataclasses.dataclass(frozen=True, eq=False)
class StationaryWeights:
    """Exponents of the shares of time spent at each attractor in the long run, at one noise intensity.

    A share is exp(−w/D) times a prefactor. The activation energies do not determine the prefactor, which may be many
    powers of ten, so that no share follows from them; `vibrokit.occupancies` has shares, from rates.
    """

    names: Annotated[tuple[str, ...], "names of the attractors, in the order of their labels"]
    intensity: Annotated[float, "noise intensity D", "m2 s-3"]
    exponents: Annotated[Array, "−w/D; 0 for the most stable, −∞ for one that is not reached, NaN where not known"]
    lower: Annotated[Array, "lower bound of each, from those of the energies"]
    upper: Annotated[Array, "upper bound of each"]

    def __str__(self) -> str:
        if np.isnan(self.exponents).any():
            return f"Exponents of the stationary weights at D = {self.intensity:g} are not known."
        rows = zip(self.names, self.exponents, self.lower, self.upper, strict=True)
        shown = ", ".join(f"{name} {_shown(*numbers)}" for name, *numbers in rows if numbers[0] > -math.inf)
        return f"ln of the stationary weights at D = {self.intensity:g}, up to unknown prefactors: {shown}."


@dataclasses.dataclass(frozen=True, eq=False)
class Transitions(metaclass=Constructed):
    """Activation energies between all attractors, and the long-term behaviour under weak noise that follows from them.

    For D → 0 the motion jumps from attractor i to attractor j at rates like exp(−V_ij/D), and the stationary weight of
    attractor i goes like exp(−w_i/D). w_i is the least sum of V over the graphs that lead from every other attractor to
    i, minus the smallest such sum of all attractors (Freidlin and Wentzell, Random Perturbations of Dynamical Systems,
    3rd ed., Springer 2012, chapter 6). Both are exponents only: the prefactors are not known here.

    Attributes
    ----------
    names : tuple of str
        Of the attractors, in the order of rows, columns and labels.
    energies : array (count, count)
        Least activation energy V_ij of a direct exit from row i to column j (m² s⁻³); infinite where no exit was
        found, 0 on the diagonal.
    lower, upper : array (count, count)
        Bounds of each. Where no exit was found, `upper` is infinite, and `lower` is 0 unless the search from that
        attractor excludes cheaper paths.

    Raises
    ------
    StructureError
        Names repeat, arrays have another shape, or the bounds do not enclose the energies.
    """

    names: tuple[str, ...]
    energies: Array
    lower: Array
    upper: Array

    def __post_init__(self) -> None:
        if not isinstance(self.names, tuple) or not all(isinstance(name, str) for name in self.names):
            raise StructureError(f"names of attractors must be a tuple of texts, got {shown(self.names)}.")
        count = len(self.names)
        if len(set(self.names)) != count:
            raise StructureError(f"names of attractors must differ, got {', '.join(self.names)}.")
        for name in ("energies", "lower", "upper"):
            values = getattr(self, name)
            shape = values.shape if isinstance(values, np.ndarray) and values.dtype.kind in "iuf" else None
            if shape != (count, count):
                raise StructureError(
                    f"transitions of {count} attractors need {name}, an array of numbers of shape {(count,) * 2}, "
                    f"got {shown(values)}."
                )
        if not np.all((self.lower >= 0) & (self.lower <= self.energies) & (self.energies <= self.upper)):
            raise StructureError("transitions need 0 ≤ lower ≤ energies ≤ upper, and no NaN.")

    @classmethod
    @called
    def of(cls, *results: Result) -> Transitions:
        """Collect the energies of results on one scene, the least of each pair of attractors.

        Exits that lead to no attractor, such as a first contact, are left out.

        Raises
        ------
        StructureError
            The results are of different scenes, or no energy leads to another attractor.
        """
        for result in results:
            if not isinstance(result, Result):
                raise StructureError(f"transitions need results, as of LeastAction, got {shown(result)}.")
        if not results or any(
            (one.names, per_unit_mass(one.scene)) != (results[0].names, per_unit_mass(results[0].scene))
            for one in results
        ):
            raise StructureError("transitions need at least one result, and all results must be of one scene.")
        found = [energy for result in results for energy in result.energies if energy.target >= 0]
        if not found:
            raise StructureError(
                "no activation energy leads to another attractor, so there are no transitions; analyze the attractors "
                "with the exit leave-basin."
            )
        count = len(results[0].names)
        energies, lower, upper = (np.where(np.eye(count, dtype=bool), 0.0, np.inf) for _ in range(3))
        for source in range(count):
            own = [energy for energy in found if energy.source == source]
            if not own or min(energy.lower for energy in own) <= 0:  # then an exit that was not found is not excluded
                lower[source] = 0.0
            for energy in sorted(own, key=lambda energy: (-energy.value, energy.lower)):  # the least is written last
                at = source, energy.target
                energies[at], lower[at], upper[at] = energy.value, energy.lower, energy.upper
        return cls(results[0].names, energies, lower, upper)

    @cached_property
    def missing(self) -> tuple[int, ...]:
        """Labels of the attractors from which no exit to another one is known."""
        exits = np.isfinite(self.energies) & ~np.eye(len(self.names), dtype=bool)
        return tuple(np.flatnonzero(~exits.any(axis=1)).tolist()) if len(self.names) > 1 else ()

    @cached_property
    def known(self) -> bool:
        """Whether weights follow: each attractor is left, and at least one is reached from all others."""
        return bool(self.names) and not self.missing and bool(np.isfinite(tree_costs(self.energies)).any())

    @cached_property
    def weights(self) -> Array:
        """Exponents w_i of the stationary weights (m² s⁻³): 0 for the most stable, NaN where not known.

        Infinite for an attractor that is not reached.
        """
        if not self.known:
            return np.full(len(self.names), np.nan)
        costs = tree_costs(self.energies)
        return costs - costs.min()

    @property
    def weight_bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds of `weights`, for all energies within their bounds."""
        if not self.known:
            return self.weights, self.weights
        low, high = self._differences
        return np.maximum(low.max(axis=1), 0.0), np.maximum(high.max(axis=1), 0.0)

    @property
    def leading(self) -> tuple[int, ...]:
        """Labels of those that may be the most stable, within the bounds; empty where weights are not known."""
        if not self.known:
            return ()
        rounding = 1e-12 * self.energies[np.isfinite(self.energies)].max()
        return tuple(np.flatnonzero(self._differences[0].max(axis=1) <= rounding).tolist())

    @property
    def most_stable(self) -> int | None:
        """Label of the attractor of largest weight; None where it is not known or the bounds do not decide."""
        return self.leading[0] if len(self.leading) == 1 else None

    @cached_property
    def cycle_hierarchy(self) -> tuple[Cycle, ...]:
        """How attractors, and groups of attractors among which the motion cycles, are left; the fastest first."""
        return cycle_hierarchy(self.energies, self.lower, self.upper)

    @property
    def quasi_potentials(self) -> Array:
        """Least cost of getting from row to column, also through other attractors (m² s⁻³); shape of `energies`."""
        return self._shortest[0]

    @called
    def route(self, source: int | str, target: int | str) -> tuple[int, ...]:
        """Return the labels along the cheapest route, both ends included; empty if there is no route.

        Raises
        ------
        StructureError
            There is no such attractor.
        """
        start, node = label_of(source, self.names), label_of(target, self.names)
        costs, before = self._shortest
        if not math.isfinite(costs[start, node]):
            return ()
        route = [node]
        while route[-1] != start:
            route.append(int(before[start, route[-1]]))
        return tuple(reversed(route))

    @called
    def stationary_weights(self, intensity: float) -> StationaryWeights:
        """Return the exponents of the stationary weights at a noise intensity D (m² s⁻³).

        Raises
        ------
        StructureError
            The intensity is not positive and finite.
        """
        if not (math.isfinite(intensity) and intensity > 0):
            raise StructureError(f"the noise intensity must be positive and finite, got {intensity!r}.")
        low, high = self.weight_bounds
        with np.errstate(over="ignore"):
            exponents, lower, upper = (0.0 - w / intensity for w in (self.weights, high, low))
        return StationaryWeights(self.names, intensity, exponents, lower, upper)

    @property
    def verdict(self) -> str:
        """Which attractor is the most stable under weak noise, or why this is not known, as a sentence."""
        if self.missing:
            return (
                f"No exit from {self._listed(self.missing)} to another attractor is known, so the most stable "
                "attractor does not follow."
            )
        if not self.known:
            return "No attractor is reached from all others, so the most stable attractor does not follow."
        unreached = np.flatnonzero(np.isinf(self.weights)).tolist()
        rest = f" No path to {self._listed(unreached)} was found." if unreached else ""
        if self.most_stable is not None:
            return f"The most stable attractor under weak noise is {self.names[self.most_stable]}.{rest}"
        return f"The bounds do not decide which attractor is the most stable: {self._listed(self.leading)}.{rest}"

    def __str__(self) -> str:
        rows = [
            ("from \\ to", *self.names),
            *(
                (name, *("–" if i == j else _shown(*numbers) for j, numbers in enumerate(zip(*row, strict=True))))
                for i, (name, *row) in enumerate(zip(self.names, self.energies, self.lower, self.upper, strict=True))
            ),
        ]
        lines = [*text_table(rows), "", self.verdict]
        if self.cycle_hierarchy:
            lines += ["Exits, the fastest first; mean times grow like exp(energy/D):"]
            lines += [f"  {self._sentence(cycle)}" for cycle in self.cycle_hierarchy]
        if self.known:
            exponents = zip(self.names, self.weights, *self.weight_bounds, strict=True)
            shown = ", ".join(f"{name} {_shown(*numbers)}" for name, *numbers in exponents if numbers[0] < math.inf)
            lines += [f"Stationary weights go like exp(−w/D), with w: {shown}."]
        return "\n".join(lines)

    def _sentence(self, cycle: Cycle) -> str:
        group = f", from the group {self._listed(cycle.members)}" if len(cycle.members) > 1 else ""
        energy = _shown(cycle.energy, cycle.lower, cycle.upper)
        return f"{exit_between(self.names, cycle.source, cycle.target)}: {energy}{group}"

    def _listed(self, labels: Sequence[int]) -> str:
        return ", ".join(self.names[label] for label in labels)

    @cached_property
    def _differences(self) -> tuple[Array, Array]:
        """Bounds of w_i − w_j, shape (count, count) each, 0 on the diagonal."""
        shape = (len(self.names),) * 2

        def both(energies: Array) -> tuple[Array, Array]:
            costs = tree_costs(energies)
            return np.broadcast_to(costs[:, None], shape), np.broadcast_to(costs[None], shape)

        low, high = difference_bounds(self.lower, self.upper, both)
        off_diagonal = ~np.eye(len(self.names), dtype=bool)
        return np.where(off_diagonal, low, 0.0), np.where(off_diagonal, high, 0.0)

    @cached_property
    def _shortest(self) -> tuple[Array, NDArray[np.int32]]:
        """Costs of the cheapest routes, and the node before each on the route from each."""
        graph = csgraph_from_dense(self.energies, null_value=np.inf)  # exits of energy 0 stay exits
        return dijkstra(graph, return_predecessors=True)


def _shown(value: float, lower: float, upper: float) -> str:
    """Return a number, with its bounds where these differ in the digits shown."""
    if math.isinf(value):
        return "no exit" if math.isinf(lower) else "not found"
    if math.isinf(upper):
        return f"{value:.4g} ({lower:.3g} or more)" if lower > 0 else f"{value:.4g} (not bounded)"
    return f"{value:.5g}" if upper - lower <= 1e-4 * abs(value) else f"{value:.4g} ({lower:.3g} to {upper:.3g})"
