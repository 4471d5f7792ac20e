"""Pictures of an action plot."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray
from matplotlib.axes import Axes

from vibrokit.plots.axes import axes_or_new, colour
from vibrokit.plots.basins import basin_map


def _labels(data: xarray.Dataset, prefix: str) -> list[int]:
    return sorted(int(str(name).removeprefix(prefix)) for name in data.variables if str(name).startswith(prefix))


def _scientific(value: float) -> str:
    mantissa, exponent = f"{value:.3e}".split("e")
    return rf"{mantissa} \times 10^{{{int(exponent)}}}"


def action_plot(data: xarray.Dataset, energies: Sequence[Any], *, ax: Axes | None = None) -> list[Any]:
    """Draw the action of each exit against the angle of its start, on a logarithmic scale.

    Parameters
    ----------
    data : xarray.Dataset
        ``angle_k`` and ``action_k`` for the attractors that were left.
    energies : sequence of ActivationEnergy
        Drawn as lines.
    ax : matplotlib Axes, optional

    Returns
    -------
    list of artists
    """
    axes = axes_or_new(ax)
    artists: list[Any] = []
    for label in _labels(data, "action_"):
        angle, action = data[f"angle_{label}"].values, data[f"action_{label}"].values
        artists += axes.plot(
            np.degrees(angle), action, ".", markersize=1.5, color=colour(label), rasterized=True,
            label=f"leaving attractor {label}",
        )  # fmt: skip
    for energy in energies:
        artists.append(axes.axhline(energy.value, color=colour(energy.source), linewidth=0.8))
        artists.append(
            axes.annotate(
                rf"$\Delta U = {_scientific(energy.value)}$", (360, energy.value), ha="right", va="top", fontsize=8,
                xytext=(0, -2), textcoords="offset points", color=colour(energy.source),
            )
        )  # fmt: skip
    axes.set_yscale("log")
    axes.set_xlim(0, 360)
    axes.set_xlabel(r"angle of the start $\theta$ (°)")
    axes.set_ylabel(r"action at the exit $S$ (m$^2$ s$^{-3}$)")
    axes.legend(loc="upper right", markerscale=6, fontsize=8)
    return artists


def exit_paths(data: xarray.Dataset, energies: Sequence[Any], *, ax: Axes | None = None) -> list[Any]:
    """Draw the cheapest exit paths by their points on the section, over the basins.

    Parameters
    ----------
    data : xarray.Dataset
        ``basin``, ``points_k``, and the bounds in the attribute ``region``.
    energies : sequence of ActivationEnergy
    ax : matplotlib Axes, optional

    Returns
    -------
    list of artists
    """
    axes = axes_or_new(ax, 5.4, 4.6)
    points = [data[f"points_{label}"].values for label in _labels(data, "points_")]
    artists = basin_map(data["basin"].values, np.reshape(data.attrs["region"], (2, 2)), points, ax=axes)
    for energy in energies:
        if energy.path is not None:
            place = energy.path.q[energy.path.section]
            artists += axes.plot(
                place[:, 0], place[:, 1], ".-", color=colour(energy.source), markersize=3, linewidth=0.7,
                label=f"exit path {energy.source} → {energy.target}",
            )  # fmt: skip
    axes.legend(loc="upper left", fontsize=8)
    return artists
