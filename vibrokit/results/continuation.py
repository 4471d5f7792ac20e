"""Continuation: what becomes of the steady states as one parameter changes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
import xarray
from numpy.typing import NDArray

from vibrokit.results.attractor import Attractor
from vibrokit.results.bifurcation import Bifurcation
from vibrokit.results.continuation_table import continuation_dataset, read_continuation
from vibrokit.results.labels import label_of
from vibrokit.results.record import Record
from vibrokit.results.region import Region
from vibrokit.results.steady_states import SteadyStates
from vibrokit.results.summary import Summary, counted

if TYPE_CHECKING:
    from vibrokit.plots.bifurcation import BifurcationArtists, FractionArtists

_GREEK = (
    "alpha", "beta", "gamma", "delta", "epsilon", "zeta", "eta", "theta", "kappa", "lambda",
    "mu", "nu", "xi", "rho", "sigma", "tau", "phi", "chi", "psi", "omega",
)  # fmt: skip


class Continuation(Record):
    """Steady states along values of a parameter, joined into branches, with the bifurcations between.

    Attributes
    ----------
    parameter : str
        Path of the parameter, as in ``osc.parameters``.
    symbol : str
        Its letter, as SymPy writes it.
    unit : str or None
        In SI base units.
    region : Region or None
        What basin fractions are shares of, the same at all values; None if nothing was found.
    states : tuple of SteadyStates
        One for each value, in ascending order.
    branch_names : tuple of str
        Name of each branch, that of its first attractor.
    bifurcations : tuple of Bifurcation
        In ascending order of the value.
    """

    kind: ClassVar[str] = "continuation"

    parameter: str
    symbol: str
    unit: str | None
    region: Region | None
    states: tuple[SteadyStates, ...]
    branch_names: tuple[str, ...]
    bifurcations: tuple[Bifurcation, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the branches, in the order of their numbers; attractors have other labels at each value."""
        return self.branch_names

    @property
    def values(self) -> NDArray[np.float64]:
        """Values of the parameter, ascending."""
        return np.array([at.value for at in self.states])

    @property
    def branches(self) -> tuple[int, ...]:
        """Numbers of the branches."""
        return tuple(range(len(self.branch_names)))

    def branch(self, which: int | str) -> tuple[tuple[float, Attractor], ...]:
        """Return the values at which a branch has an attractor, each with it.

        Parameters
        ----------
        which : int or str
            Number or name of the branch; the beginning of a name is enough if it is unique.

        Raises
        ------
        StructureError
            There is no such branch.
        """
        number = label_of(which, self.branch_names, "branch")
        return tuple(
            (at.value, attractor)
            for at in self.states
            for attractor, branch in zip(at.attractors, at.branches, strict=True)
            if branch == number
        )

    def fractions(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return basin fractions and their standard errors, each of shape (values, branches).

        0 where a branch has no attractor, NaN where nothing is known: the scene was refused, or the work stopped.
        """
        shares = np.zeros((len(self.states), len(self.branches)))
        errors = np.zeros_like(shares)
        column = {branch: index for index, branch in enumerate(self.branches)}
        for row, at in enumerate(self.states):
            if not at.attractors:
                shares[row] = errors[row] = np.nan
            for attractor, branch in zip(at.attractors, at.branches, strict=True):
                shares[row, column[branch]] = attractor.basin_fraction
                errors[row, column[branch]] = attractor.basin_fraction_error
        return shares, errors

    @property
    def summary(self) -> Summary:
        """The bifurcations."""
        values = f"{counted(len(self.states), 'value')} of {self.parameter}"
        return Summary(
            f"Continuation: {counted(len(self.branches), 'branch', 'branches')} at {values}",
            tuple(
                (f"{b.kind} {b.side}".strip(), self.branch_names[b.branch], f"{b.value:.8g} ± {b.error:.1g}")
                for b in self.bifurcations
            ),
        )

    @property
    def axis_label(self) -> str:
        """Label of the parameter's axis, with symbol and unit in TeX."""
        head, _, index = self.symbol.partition("_")
        letter = f"\\{head}" if head in _GREEK else head
        label = f"{self.parameter} ${letter}{f'_{{{index}}}' if index else ''}$"
        return f"{label} ({_unit_in_tex(self.unit)})" if self.unit else label

    def plot(self, ax: Any = None) -> BifurcationArtists:
        """Draw the bifurcation diagram; see `vibrokit.plots.bifurcation.bifurcation_diagram`."""
        from vibrokit.plots.bifurcation import bifurcation_diagram

        rows = [
            (at.value, x, branch)
            for at in self.states
            for attractor, branch in zip(at.attractors, at.branches, strict=True)
            for x in attractor.points[:, 0]
        ]
        values, x, branches = (np.array(column) for column in (zip(*rows, strict=True) if rows else ([], [], [])))
        marks = [(found.kind, found.value, float(found.point[0])) for found in self.bifurcations]
        return bifurcation_diagram(values, x, branches, marks, names=self.branch_names, label=self.axis_label, ax=ax)

    def plot_fractions(self, ax: Any = None) -> FractionArtists:
        """Draw the basin fractions along the parameter; see `vibrokit.plots.bifurcation.basin_fractions`."""
        from vibrokit.plots.bifurcation import basin_fractions

        shares, _ = self.fractions()
        return basin_fractions(self.values, shares.T, self.branch_names, label=self.axis_label, ax=ax)

    def to_dataset(self) -> xarray.Dataset:
        """Return the arrays with dimensions, coordinates, units and long names."""
        return continuation_dataset(self)

    @classmethod
    def from_dataset(cls, dataset: xarray.Dataset, **provenance: Any) -> Self:
        """Make a continuation of its arrays; raises ResultFileError."""
        return cls(**read_continuation(dataset), **provenance)


def _unit_in_tex(unit: str) -> str:
    words = []
    for word in unit.split():
        base, _, power = word.partition("^")
        words.append(f"{base}$^{{{power}}}$" if power else base)
    return " ".join(words)
