"""Result: what an analyzer returns."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar, Self

import xarray

from vibrokit.errors import StructureError
from vibrokit.registry import load_attribute
from vibrokit.results.arrays import Arrays
from vibrokit.results.data import data_in, joined, joined_with
from vibrokit.results.energy import ActivationEnergy
from vibrokit.results.energy_table import energy_variables, read_energies
from vibrokit.results.labels import label_of
from vibrokit.results.path_pictures import plot_exit_paths, plot_histories
from vibrokit.results.quasi_potential import plot_quasi_potential
from vibrokit.results.record import Record
from vibrokit.results.section import Section
from vibrokit.results.structure import Structure
from vibrokit.results.summary import Summary, counted

if TYPE_CHECKING:
    from vibrokit.analyzers.analyzer import Analyzer
    from vibrokit.plots.exit_paths import ExitPathArtists, HistoryArtists
    from vibrokit.plots.quasi_potential import QuasiPotentialArtists


class Result(Record):
    """The outcome of one analysis.

    Attributes
    ----------
    energies : tuple of ActivationEnergy
        The best one of each exit of each attractor.
    branches : tuple of ActivationEnergy
        All exit paths that were found, also those that are not the best.
    section : Section
        Basins, attractors, saddles and stable manifolds.
    data : xarray.Dataset
        Arrays behind the numbers, along the dimension ``source`` (labels of attractors).

    For developers
    --------------
    A method whose results are activation energies needs no subclass. One with a picture of its own names a `kind`,
    writes `plot`, and registers the class under the entry-point group ``vibrokit.records``.
    """

    kind: ClassVar[str] = "energies"

    energies: tuple[ActivationEnergy, ...]
    section: Section
    branches: tuple[ActivationEnergy, ...] = ()
    data: xarray.Dataset = dataclasses.field(default_factory=xarray.Dataset)

    @classmethod
    def assembled(
        cls,
        structure: Structure,
        *,
        estimates: Mapping[int, tuple[ActivationEnergy, ...]],
        branches: Mapping[int, tuple[ActivationEnergy, ...]],
        data: Mapping[int, xarray.Dataset],
        **provenance: Any,
    ) -> Self:
        """Put together what was found about each attractor, by label."""
        return cls(
            energies=tuple(energy for some in estimates.values() for energy in some),
            branches=tuple(branch for some in branches.values() for branch in some),
            section=Section.of(structure),
            data=joined(data, structure.names),
            **provenance,
        )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the attractors, in the order of their labels."""
        return self.section.names

    def energy(self, source: int | str, target: int | str | None = None) -> ActivationEnergy:
        """Return the activation energy of one exit, by labels or names.

        Parameters
        ----------
        source : int or str
        target : int or str, optional
            By default the exit of least energy.

        Raises
        ------
        StructureError
            There is no such attractor, or no energy is known for this exit.
        """
        start = label_of(source, self.names)
        end = -1 if target in (-1, "exit") else None if target is None else label_of(target, self.names)
        found = [e for e in self.energies if e.source == start and end in (None, e.target)]
        if not found:
            known = ", ".join(self.exit_of(e) for e in self.energies) or "none"
            wanted = self.names[start] if end is None else f"{self.names[start]} → {self._named(end)}"
            raise StructureError(f"there is no energy of {wanted}; the result has {known}.")
        return min(found, key=lambda energy: energy.value)

    def exit_of(self, energy: ActivationEnergy) -> str:
        """Return the names of the attractors between which an exit leads: ``"hammering → clear"``."""
        return f"{self._named(energy.source)} → {self._named(energy.target)}"

    def _named(self, label: int) -> str:
        return self.names[label] if label >= 0 else "exit"

    @property
    def summary(self) -> Summary:
        """The energies."""
        return Summary(
            f"{type(self).__name__}: {counted(len(self.energies), 'energy', 'energies')}",
            tuple(
                (self.exit_of(e), f"ΔU = {e.value:.6g} m² s⁻³", f"{e.lower:.6g} to {e.upper:.6g} ({e.bound})", e.method)
                for e in self.energies
            ),
        )

    @property
    def analyzer(self) -> Analyzer:
        """The analyzer that made this result, built again from the settings."""
        # Analyzers stand above this layer; they are found by name, as plug-ins are.
        analyzer: Analyzer = load_attribute("vibrokit.analyzers.settings:analyzer_from")(self.settings)
        return analyzer

    def plot(self, ax: Any = None) -> Any:
        """Draw the exit paths over basins and manifolds; see `vibrokit.plots.exit_paths.exit_paths`."""
        return self.plot_paths(ax)

    def plot_paths(self, ax: Any = None) -> ExitPathArtists:
        """Draw the exit paths over basins and manifolds; see `vibrokit.plots.exit_paths.exit_paths`."""
        return plot_exit_paths(self, ax)

    def plot_history(self, ax: Any = None) -> HistoryArtists:
        """Draw p₂ and S along each exit path; see `vibrokit.plots.exit_paths.path_history`.

        Raises
        ------
        StructureError
            No energy has a path.
        """
        return plot_histories(self, ax)

    def plot_quasi_potential(self, source: int | str | None = None, ax: Any = None) -> QuasiPotentialArtists:
        """Draw a quasi-potential on the section; see `vibrokit.plots.quasi_potential.quasi_potential_map`.

        Parameters
        ----------
        source : int or str, optional
            Label or name of the attractor; by default the first that has one.
        ax : matplotlib Axes, optional

        Raises
        ------
        StructureError
            It was not computed for this attractor, or for any.
        """
        return plot_quasi_potential(self, source, ax)

    def to_dataset(self) -> xarray.Dataset:
        """Return the arrays with dimensions, coordinates, units and long names.

        Raises
        ------
        ResultFileError
            An array or a dimension of `data` has a name that the result uses itself.
        """
        own = self.section.variables | energy_variables(self.energies, self.branches)
        return joined_with(self.data, xarray.Dataset(own).set_coords("attractor_name"))

    @classmethod
    def from_dataset(cls, dataset: xarray.Dataset, **provenance: Any) -> Self:
        """Make a result of its arrays; raises ResultFileError."""
        arrays = Arrays(dataset)
        section = Section.read(arrays)
        energies, branches = read_energies(arrays, len(section.names))
        return cls(energies=energies, branches=branches, section=section, data=data_in(dataset), **provenance)
