"""Result: what an analyzer returns."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self

import numpy as np
import xarray

from vibrokit.construction import called
from vibrokit.errors import ResultFileError, StructureError, counted
from vibrokit.results.arrays import Arrays
from vibrokit.results.data import check_names, data_in, joined
from vibrokit.results.energy import ActivationEnergy, ExitPath, bounds_text, energy_variables, read_energies
from vibrokit.results.exit_rate import ExitRate
from vibrokit.results.labels import exit_between, goal_of, label_of, source_among
from vibrokit.results.record import Record, Summary
from vibrokit.results.section import Section
from vibrokit.results.structure import Structure

if TYPE_CHECKING:
    from vibrokit.analyzers.analyzer import Analyzer
    from vibrokit.plots.exit_paths import ExitPathArtists, HistoryArtists
    from vibrokit.plots.quasi_potential import QuasiPotentialArtists

_DATA = "arrays behind the numbers, along the dimension ``source`` (labels of attractors)"
_AT_REST = 0.01  # of the extent of a path: a path that moves less at first leaves an equilibrium
_SHOWN = 1.5  # times the largest energy: above it, all shades of a quasi-potential are the same


class Result(Record):
    """The outcome of one analysis.

    For developers
    --------------
    A method whose results are activation energies needs no subclass. One with a picture of its own names a `kind`,
    writes `plot`, and registers the class under the entry-point group ``vibrokit.records``.
    """

    kind: ClassVar[str] = "energies"
    refined_by: ClassVar[str] = "run it again with finer settings"
    """What makes its numbers more certain."""

    energies: Annotated[tuple[ActivationEnergy, ...], "the best one of each exit of each attractor"]
    section: Annotated[Section, "basins, attractors, saddles and stable manifolds"]
    branches: Annotated[tuple[ActivationEnergy, ...], "all exit paths, also those that are not the best"] = ()
    data: Annotated[xarray.Dataset, _DATA] = dataclasses.field(default_factory=xarray.Dataset)

    def __post_init__(self) -> None:
        super().__post_init__()
        check_names(self.data, self.section.grid)

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
        """Put together what was found about each attractor, by label.

        Raises
        ------
        ResultFileError
            An array or a dimension of `data` has a name that files use otherwise, or arrays of different attractors
            contradict one another.
        """
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

    @called
    def energy(self, source: int | str, target: int | str | None = None) -> ActivationEnergy:
        """Return the activation energy of one exit, by labels or names.

        Parameters
        ----------
        source : int or str
        target : int or str, optional
            ``"escape"`` for motion that leaves the region for good, ``"exit"`` for another end that is no attractor; by
            default the exit of least energy.

        Raises
        ------
        StructureError
            There is no such attractor, or no energy is known for this exit.
        """
        start = label_of(source, self.names)
        end = None if target is None else goal_of(target, self.names)
        found = [e for e in self.energies if e.source == start and end in (None, e.target)]
        if not found:
            known = ", ".join(self.exit_of(e) for e in self.energies) or "none"
            wanted = self.names[start] if end is None else exit_between(self.names, start, end)
            raise StructureError(f"there is no energy of {wanted}; the result has {known}.")
        return min(found, key=lambda energy: energy.value)

    @called
    def exit_of(self, energy: ActivationEnergy | ExitRate) -> str:
        """Return the names of the attractors between which an exit leads: ``"hammering → clear"``."""
        return energy.exit_between(self.names)

    @property
    def rates(self) -> tuple[ExitRate, ...]:
        """Exit rates at finite noise; only methods that take the noise as it is have them."""
        return ()

    @property
    def summary(self) -> Summary:
        """The energies."""
        return Summary(
            f"{type(self).__name__}: {counted(len(self.energies), 'energy', 'energies')}",
            tuple(
                (
                    self.exit_of(e),
                    f"ΔU = {e.value:.6g} m² s⁻³",
                    f"{bounds_text(e)} ({e.bound})",
                    e.method,
                )
                for e in self.energies
            ),
        )

    @property
    def analyzer(self) -> Analyzer:
        """The analyzer that made this result, built again from the settings."""
        from vibrokit.analyzers.settings import analyzer_from

        return analyzer_from(self.settings)

    @called
    def plot(self, ax: Any = None) -> Any:
        """Draw the exit paths over basins and manifolds; see `vibrokit.plots.exit_paths.exit_paths`."""
        return self.plot_paths(ax)

    @called
    def plot_paths(self, ax: Any = None) -> ExitPathArtists:
        """Draw the exit paths over basins and manifolds; see `vibrokit.plots.exit_paths.exit_paths`."""
        from vibrokit.plots.exit_paths import exit_paths

        section, drawn = self.section, _with_paths(self.energies)
        curves = [_from_rest(path) for _, path in drawn]
        return exit_paths(
            section.labels,
            section.bounds,
            section.points,
            [path.q if curve else path.q[path.section] for curve, (_, path) in zip(curves, drawn, strict=True)],
            sources=[energy.source for energy, _ in drawn],
            titles=[self._title(energy) for energy, _ in drawn],
            names=section.names,
            curves=curves,
            saddles=section.saddles,
            chaotic=section.chaotic,
            stable=section.stable,
            ax=ax,
        )

    @called
    def plot_history(self, ax: Any = None) -> HistoryArtists:
        """Draw p₂ and S along each exit path; see `vibrokit.plots.exit_paths.path_history`.

        Raises
        ------
        StructureError
            No energy has a path.
        """
        from vibrokit.plots.exit_paths import path_history

        drawn = _with_paths(self.energies)
        if not drawn:
            raise StructureError("the result has no exit path, so there is no history to draw; see its status.")
        steps = [step for _, path in drawn for step in np.diff(path.t[path.section]).tolist()]
        return path_history(
            [(path.t, path.p[:, 1], path.action, path.section) for _, path in drawn],
            sources=[energy.source for energy, _ in drawn],
            titles=[self._title(energy) for energy, _ in drawn],
            period=float(np.median(steps)) if steps and min(steps) > 0 else None,
            ax=ax,
        )

    def _title(self, energy: ActivationEnergy) -> str:
        """What pictures call a path."""
        from vibrokit.plots.axes import scientific

        return f"{self.exit_of(energy)}, $\\Delta U$ = ${scientific(energy.value)}$ m$^2$ s$^{{-3}}$"

    @called
    def plot_quasi_potential(self, source: int | str | None = None, ax: Any = None) -> QuasiPotentialArtists:
        """Draw a quasi-potential on the section; see `vibrokit.plots.quasi_potential.quasi_potential_map`.

        Parameters
        ----------
        source : int or str, optional
            Label or name of the attractor; by default the first that has one.
        ax : matplotlib.axes.Axes, optional

        Raises
        ------
        StructureError
            It was not computed for this attractor, or for any.
        ResultFileError
            The arrays are not those of a quasi-potential, which `ActionGraphResult` describes.
        """
        from vibrokit.plots.quasi_potential import quasi_potential_map

        known = self._quasi_potentials()
        if not known:
            raise StructureError("the result has no quasi-potential; ActionGraph computes one.")
        label = source_among(known, source, self.names, "quasi-potential", "of")
        values, bounds = known[label]
        own = [energy for energy in self.energies if energy.source == label]
        return quasi_potential_map(
            values,
            bounds,
            self.section.points[label],
            label=label,
            names=self.names,
            top=_SHOWN * max(energy.value for energy in own) if own else None,
            saddles=self.section.saddles,
            paths=[path.q[path.section] for _, path in _with_paths(own)],
            ax=ax,
        )

    def _quasi_potentials(self) -> dict[int, tuple[Any, Any]]:
        """By label: the quasi-potential on the nodes, and the bounds of the cells around them."""
        arrays = Arrays(self.data)
        if "quasi_potential" not in arrays:
            return {}
        labels = arrays.wholes("source", (None,), 0, len(self.names) - 1)
        values = arrays.numbers("quasi_potential", (len(labels), None, None), finite=False)
        nodes = [arrays.numbers(f"quasi_potential_{axis}", (len(labels), None), finite=False) for axis in ("x", "v")]
        if values.shape[1:] != (nodes[0].shape[1], nodes[1].shape[1]):
            raise ResultFileError(f"its quasi_potential has shape {values.shape}, which its nodes contradict")
        known = {}
        for label, psi, *axes in zip(labels.tolist(), values, *nodes, strict=True):
            if np.isfinite(psi).any():
                x, v = (axis[: np.isfinite(axis).sum()] for axis in axes)  # shorter ones end in NaN
                known[label] = psi[: len(x), : len(v)], np.array([_bounds(x), _bounds(v)])
        return known

    def to_dataset(self) -> xarray.Dataset:
        """Return the arrays with dimensions, coordinates, units and long names."""
        own = xarray.Dataset(self.section.variables | energy_variables(self.energies, self.branches))
        own = own.set_coords("attractor_name")
        return own.assign_coords(self.data.coords).assign(self.data.data_vars).assign_attrs(self.data.attrs)

    @classmethod
    def from_dataset(cls, dataset: xarray.Dataset, **provenance: Any) -> Self:
        """Make a result of its arrays; raises ResultFileError."""
        arrays = Arrays(dataset)
        section = Section.read(arrays)
        energies, branches = read_energies(arrays, len(section.names))
        return cls(energies=energies, branches=branches, section=section, data=data_in(dataset), **provenance)


def _with_paths(energies: Iterable[ActivationEnergy]) -> list[tuple[ActivationEnergy, ExitPath]]:
    """The energies that have a path, each with it."""
    return [(energy, energy.path) for energy in energies if energy.path is not None]


def _from_rest(path: ExitPath) -> bool:
    """Whether a path leaves a state of rest: then the whole curve is shown, and samples by phase have no meaning."""
    if len(path.section) < 2:
        return False
    begun = np.ptp(path.q[: path.section[1] + 1], axis=0)
    return bool(np.all(begun <= _AT_REST * np.ptp(path.q, axis=0)))


def _bounds(nodes: Any) -> tuple[float, float]:
    """Bounds of the cells around the nodes of one axis."""
    if len(nodes) < 2 or not np.all(np.diff(nodes) > 0):
        raise ResultFileError("its quasi_potential needs at least two nodes along each side, in ascending order")
    half = (nodes[-1] - nodes[0]) / (len(nodes) - 1) / 2
    return float(nodes[0] - half), float(nodes[-1] + half)
