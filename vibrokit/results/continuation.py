"""Continuation: what becomes of the steady states as one parameter changes."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import StructureError
from vibrokit.results.attractor import Attractor
from vibrokit.results.region import Region

BIFURCATIONS = (
    "fold", "pitchfork or transcritical", "period doubling", "Neimark–Sacker", "Hopf", "grazing",
)  # fmt: skip
_GREEK = (
    "alpha", "beta", "gamma", "delta", "epsilon", "zeta", "eta", "theta", "kappa", "lambda",
    "mu", "nu", "xi", "rho", "sigma", "tau", "phi", "chi", "psi", "omega",
)  # fmt: skip


@dataclasses.dataclass(frozen=True, eq=False)
class Bifurcation:
    """A value of the parameter at which a branch of steady states changes in kind.

    Attributes
    ----------
    kind : str
        ``"fold"`` (the branch turns back), ``"pitchfork or transcritical"`` (another branch crosses it), ``"period
        doubling"``, ``"Neimark–Sacker"``, ``"Hopf"``, or ``"grazing"`` (one more turn of the orbit touches a stop, or
        an equilibrium does).
    value : float
        Of the parameter.
    error : float
        How far it moves when the integration is tightened; where it is only known to lie between two values, half
        their distance; where it can be approached from one side only, how far the nearest orbit is.
    branch : int
    period : int
        Of the orbit, in forcing periods; 1 for an equilibrium or a limit cycle. For a period doubling, of the orbit
        that doubles.
    point : array (n,)
        A point of the orbit there, on the section.
    side : str
        For grazing, of the stop; empty for the others.
    """

    kind: str
    value: float
    error: float
    branch: int
    period: int
    point: NDArray[np.float64]
    side: str = ""

    def __str__(self) -> str:
        side = f" at the {self.side} stop" if self.side else ""
        return f"{self.kind}{side} of branch {self.branch} at {self.value:.8g} ± {self.error:.1g}"


@dataclasses.dataclass(frozen=True, eq=False)
class SteadyStates:
    """The steady states at one value of the parameter.

    Attributes
    ----------
    value : float
    attractors : tuple of Attractor
        Labelled by their places. Orbits are thinned to some 1000 samples; basin fractions are NaN if the work was
        stopped before them.
    branches : tuple of int
        The branch that each attractor belongs to.
    status : str
        What was found and what was not, or why nothing was, as sentences.
    """

    value: float
    attractors: tuple[Attractor, ...]
    branches: tuple[int, ...]
    status: str


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Continuation:
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
    bifurcations : tuple of Bifurcation
        In ascending order of the value.
    complete : bool
        False if the work was stopped before its end.
    status : str
    scene : dict
        The scene as plain data, with every parameter; that which is changed has the value it was given with.
    seed : int or None
    seconds : float
        Time that it took.
    versions : dict
        Versions of the toolkit and of what it stands on.
    """

    parameter: str
    symbol: str
    unit: str | None
    region: Region | None
    states: tuple[SteadyStates, ...]
    bifurcations: tuple[Bifurcation, ...]
    complete: bool
    status: str
    scene: Mapping[str, Any]
    seed: int | None
    seconds: float
    versions: Mapping[str, str]

    def __repr__(self) -> str:
        return f"<Continuation: {self.status}>"

    @property
    def values(self) -> NDArray[np.float64]:
        """Values of the parameter, ascending."""
        return np.array([at.value for at in self.states])

    @property
    def branches(self) -> tuple[int, ...]:
        """Numbers of the branches."""
        return tuple(sorted({branch for at in self.states for branch in at.branches}))

    def branch(self, number: int) -> tuple[tuple[float, Attractor], ...]:
        """Return the values at which a branch has an attractor, each with it.

        Raises
        ------
        StructureError
            There is no such branch.
        """
        found = tuple(
            (at.value, attractor)
            for at in self.states
            for attractor, branch in zip(at.attractors, at.branches, strict=True)
            if branch == number
        )
        if not found:
            raise StructureError(f"there is no branch {number!r}; there are {', '.join(map(str, self.branches))}.")
        return found

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
    def axis_label(self) -> str:
        """Label of the parameter's axis, with symbol and unit in TeX."""
        head, _, index = self.symbol.partition("_")
        letter = f"\\{head}" if head in _GREEK else head
        label = f"{self.parameter} ${letter}{f'_{{{index}}}' if index else ''}$"
        return f"{label} ({_unit_in_tex(self.unit)})" if self.unit else label

    def plot(self, ax: Any = None) -> Any:
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
        return bifurcation_diagram(values, x, branches, marks, label=self.axis_label, ax=ax)

    def plot_fractions(self, ax: Any = None) -> Any:
        """Draw the basin fractions along the parameter; see `vibrokit.plots.bifurcation.basin_fractions`."""
        from vibrokit.plots.bifurcation import basin_fractions

        shares, _ = self.fractions()
        names = [f"branch {branch}" for branch in self.branches]
        return basin_fractions(
            self.values, shares.T, names, label=self.axis_label, branches=self.branches, ax=ax
        )  # fmt: skip

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write to a netCDF file, whole or not at all; `vibrokit.load_result` opens it."""
        from vibrokit.results.continuation_file import save_continuation

        save_continuation(self, path)


def _unit_in_tex(unit: str) -> str:
    words = []
    for word in unit.split():
        base, _, power = word.partition("^")
        words.append(f"{base}$^{{{power}}}$" if power else base)
    return " ".join(words)
