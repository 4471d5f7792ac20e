"""Pictures of an action plot."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.lines import Line2D
from matplotlib.ticker import MultipleLocator
from numpy.typing import NDArray

from vibrokit.plots.axes import axes_or_new, colour

_PARTS = 360
_SHOWN = 10.0  # times the least action, up to which colours tell actions apart
_COLOURS = "viridis"
_BELOW = 1.4
_TOP = 300.0  # times the largest energy: what is dearer is not looked for


def _labels(data: xarray.Dataset, prefix: str) -> list[int]:
    return sorted(int(str(name).removeprefix(prefix)) for name in data.variables if str(name).startswith(prefix))


def _scientific(value: float) -> str:
    mantissa, exponent = f"{value:.3e}".split("e")
    return rf"{mantissa} \times 10^{{{int(exponent)}}}"


def action_plot(data: xarray.Dataset, energies: Sequence[Any], *, ax: Axes | None = None) -> list[Any]:
    """Draw the action of each exit against the angle of its start, on a logarithmic scale.

    Starts at all radii of the domain fall on one another; a line follows the least action of all radii.

    Parameters
    ----------
    data : xarray.Dataset
        ``angle_k`` and ``action_k`` for the attractors that were left, and ``radius_k``.
    energies : sequence of ActivationEnergy
        Drawn as horizontal lines.
    ax : matplotlib Axes, optional

    Returns
    -------
    list of artists
        For each attractor its points and, if it has starts at several radii, the line below them; then the energies.
    """
    axes = axes_or_new(ax, 6.4, 4.4)
    artists: list[Any] = []
    for label in _labels(data, "action_"):
        angle, action = data[f"angle_{label}"].values, data[f"action_{label}"].values
        whole = np.any(data[f"radius_{label}"].values > 0)
        artists += axes.plot(
            np.degrees(angle), action, ".", markersize=1.4 if whole else 1.5, color=colour(label), rasterized=True,
            alpha=0.5 if whole else 1.0, markeredgewidth=0, label=f"leaving attractor {label}",
        )  # fmt: skip
        if whole:
            middle, least = _least_by_angle(angle, action)
            artists += axes.plot(
                np.degrees(middle), least, color=colour(label), linewidth=0.9, label=f"_least of all radii, {label}"
            )
    for energy in energies:
        artists.append(axes.axhline(energy.value, color=colour(energy.source), linewidth=0.8))
        artists.append(
            axes.annotate(
                rf"$\Delta U = {_scientific(energy.value)}$", (360, energy.value), ha="right", va="top", fontsize=8,
                xytext=(-3, -2), textcoords="offset points", color=colour(energy.source),
            )
        )  # fmt: skip
    axes.set_yscale("log")
    axes.set_xlim(0, 360)
    low, high = axes.get_ylim()
    dearest = max((_TOP * energy.value for energy in energies), default=high)
    axes.set_ylim(low / _BELOW, min(high, dearest))  # room for the numbers under the lines
    axes.set_xlabel(r"angle of the start $\theta$ (°)")
    axes.set_ylabel(r"action at the exit $S$ (m$^2$ s$^{-3}$)")
    axes.xaxis.set_major_locator(MultipleLocator(60))
    legend = axes.legend(loc="upper right", fontsize=8)
    for sample in legend.legend_handles:
        if isinstance(sample, Line2D):
            sample.set(markersize=6, alpha=1.0)
    return artists


def action_map(data: xarray.Dataset, label: int, *, ax: Axes | None = None) -> list[Any]:
    """Draw the action over the fundamental domain: where each path started, coloured by what it paid.

    Starts whose paths found no exit are grey. Where starts lie close the search was refined.

    Parameters
    ----------
    data : xarray.Dataset
        ``angle_k``, ``radius_k`` and ``action_k``.
    label : int
        Of the attractor that is left, k.
    ax : matplotlib Axes, optional

    Returns
    -------
    list of artists
        Starts without an exit, starts with one, the cheapest of them.
    """
    axes = axes_or_new(ax, 7.2, 3.6)
    angle, radius, action = (data[f"{name}_{label}"].values for name in ("angle", "radius", "action"))
    out = np.isfinite(action)
    artists: list[Any] = axes.plot(
        np.degrees(angle[~out]), radius[~out], ".", color="0.85", markersize=1.0, rasterized=True, zorder=1
    )
    order = np.flatnonzero(out)[np.argsort(-action[out], kind="stable")]  # the cheap ones drawn last
    least = float(action[out].min()) if out.any() else 1.0
    points = axes.scatter(
        np.degrees(angle[order]), radius[order], c=action[order], s=2.5, linewidths=0, rasterized=True, cmap=_COLOURS,
        norm=LogNorm(least, _SHOWN * least), zorder=2,
    )  # fmt: skip
    artists.append(points)
    if out.any():
        best = order[-1]
        artists += axes.plot(
            np.degrees(angle[best]), radius[best], "o", markersize=9, markerfacecolor="none", markeredgecolor="black",
            zorder=3,
        )  # fmt: skip
    bar = axes.figure.colorbar(points, ax=axes, extend="max", pad=0.02)
    bar.set_label(r"action at the exit $S$ (m$^2$ s$^{-3}$)")
    axes.set_xlim(0, 360)
    axes.set_ylim(*((0, 1) if radius.any() else (-0.5, 0.5)))
    axes.xaxis.set_major_locator(MultipleLocator(60))
    axes.set_xlabel(r"angle of the start $\theta$ (°)")
    axes.set_ylabel("way from ellipse to image")
    axes.set_title(f"leaving attractor {label}", fontsize=10)
    return artists


def _least_by_angle(angle: NDArray[np.float64], action: NDArray[np.float64]) -> tuple[Any, Any]:
    """Middles of equal parts of the circle, and the least action that started in each; NaN where there is none."""
    part = np.minimum((angle / (2 * np.pi) * _PARTS).astype(int), _PARTS - 1)
    least = np.full(_PARTS, np.inf)
    np.minimum.at(least, part, np.where(np.isfinite(action), action, np.inf))
    return 2 * np.pi * (np.arange(_PARTS) + 0.5) / _PARTS, np.where(np.isfinite(least), least, np.nan)
