"""Pictures of the exit paths of a result: collects the arrays that they show."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrokit.errors import StructureError
from vibrokit.results.energy import ActivationEnergy, ExitPath

if TYPE_CHECKING:
    from vibrokit.plots.exit_paths import ExitPathArtists, HistoryArtists
    from vibrokit.results.result import Result

_AT_REST = 0.01  # of the extent of a path: a path that moves less at first leaves an equilibrium


def plot_exit_paths(result: Result, ax: Any = None) -> ExitPathArtists:
    """Draw exit paths over basins and manifolds; see `vibrokit.plots.exit_paths.exit_paths`."""
    from vibrokit.plots.exit_paths import exit_paths

    section, drawn = result.section, with_paths(result.energies)
    curves = [_from_rest(path) for _, path in drawn]
    return exit_paths(
        section.labels,
        section.bounds,
        section.points,
        [path.q if curve else path.q[path.section] for curve, (_, path) in zip(curves, drawn, strict=True)],
        sources=[energy.source for energy, _ in drawn],
        titles=[_title(result, energy) for energy, _ in drawn],
        names=section.names,
        curves=curves,
        saddles=section.saddles,
        chaotic=section.chaotic,
        stable=section.stable,
        ax=ax,
    )


def plot_histories(result: Result, ax: Any = None) -> HistoryArtists:
    """Draw p₂ and S along each path; see `vibrokit.plots.exit_paths.path_history`.

    Raises
    ------
    StructureError
        No energy has a path.
    """
    from vibrokit.plots.exit_paths import path_history

    drawn = with_paths(result.energies)
    if not drawn:
        raise StructureError("the result has no exit path, so there is no history to draw; see its status.")
    steps = [step for _, path in drawn for step in np.diff(path.t[path.section]).tolist()]
    return path_history(
        [(path.t, path.p[:, 1], path.action, path.section) for _, path in drawn],
        sources=[energy.source for energy, _ in drawn],
        titles=[_title(result, energy) for energy, _ in drawn],
        period=float(np.median(steps)) if steps and min(steps) > 0 else None,
        ax=ax,
    )


def with_paths(energies: Iterable[ActivationEnergy]) -> list[tuple[ActivationEnergy, ExitPath]]:
    """Return the energies that have a path, each with it."""
    return [(energy, energy.path) for energy in energies if energy.path is not None]


def _from_rest(path: ExitPath) -> bool:
    """Whether a path leaves a state of rest: then the whole curve is shown, and samples by phase have no meaning."""
    if len(path.section) < 2:
        return False
    begun = np.ptp(path.q[: path.section[1] + 1], axis=0)
    return bool(np.all(begun <= _AT_REST * np.ptp(path.q, axis=0)))


def _title(result: Result, energy: ActivationEnergy) -> str:
    """What pictures call a path."""
    return f"{result.exit_of(energy)}, $\\Delta U$ = {_in_tex(energy.value)} m$^2$ s$^{{-3}}$"


def _in_tex(value: float) -> str:
    mantissa, _, exponent = f"{value:.3e}".partition("e")
    return f"{mantissa} × 10$^{{{int(exponent)}}}$" if exponent else mantissa
