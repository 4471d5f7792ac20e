"""Pictures of the exit paths of a result, drawn of its data and energies alone."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import xarray

from vibrokit.errors import StructureError
from vibrokit.results.energy import ActivationEnergy, ExitPath
from vibrokit.results.section import Section

_AT_REST = 0.01  # of the extent of a path: by how much one moves at first that leaves an equilibrium


def plot_exit_paths(data: xarray.Dataset, energies: Iterable[ActivationEnergy], ax: Any = None) -> Any:
    """Draw exit paths over basins and manifolds; see `vibrokit.plots.exit_paths.exit_paths`.

    Parameters
    ----------
    data : xarray.Dataset
        With the section as `Section.data` lays it out.
    energies : iterable of ActivationEnergy
        Those without a path are left out.
    ax : matplotlib Axes, optional
    """
    from vibrokit.plots.exit_paths import exit_paths

    section = Section.in_data(data)
    drawn = with_paths(energies)
    curves = [_from_rest(path) for _, path in drawn]
    return exit_paths(
        section.labels,
        section.bounds,
        section.points,
        [path.q if curve else path.q[path.section] for curve, (_, path) in zip(curves, drawn, strict=True)],
        sources=[energy.source for energy, _ in drawn],
        names=[_named(energy) for energy, _ in drawn],
        curves=curves,
        saddles=section.saddles,
        chaotic=section.chaotic,
        stable=section.stable,
        ax=ax,
    )


def plot_histories(energies: Iterable[ActivationEnergy], ax: Any = None) -> Any:
    """Draw p₂ and S along each path; see `vibrokit.plots.exit_paths.path_history`.

    Raises
    ------
    StructureError
        No energy has a path.
    """
    from vibrokit.plots.exit_paths import path_history

    drawn = with_paths(energies)
    if not drawn:
        raise StructureError("the result has no exit path, so there is no history to draw; see its status.")
    steps = [step for _, path in drawn for step in np.diff(path.t[path.section]).tolist()]
    return path_history(
        [(path.t, path.p[:, 1], path.action, path.section) for _, path in drawn],
        sources=[energy.source for energy, _ in drawn],
        names=[_named(energy) for energy, _ in drawn],
        period=float(np.median(steps)) if steps and min(steps) > 0 else None,
        ax=ax,
    )


def with_paths(energies: Iterable[ActivationEnergy]) -> list[tuple[ActivationEnergy, ExitPath]]:
    """Return the energies that have a path, each with it."""
    return [(energy, energy.path) for energy in energies if energy.path is not None]


def _from_rest(path: ExitPath) -> bool:
    """Whether a path leaves a state of rest: then all of it can be shown, and points by phase would mean nothing."""
    if len(path.section) < 2:
        return False
    begun = np.ptp(path.q[: path.section[1] + 1], axis=0)
    return bool(np.all(begun <= _AT_REST * np.ptp(path.q, axis=0)))


def _named(energy: ActivationEnergy) -> str:
    """A path as pictures name it."""
    return f"path {energy.exit}, $\\Delta U$ = {_in_tex(energy.value)} m$^2$ s$^{{-3}}$"


def _in_tex(value: float) -> str:
    mantissa, _, exponent = f"{value:.3e}".partition("e")
    return f"{mantissa} × 10$^{{{int(exponent)}}}$" if exponent else mantissa
