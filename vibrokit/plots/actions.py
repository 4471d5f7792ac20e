"""Pictures of an action plot."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection
from matplotlib.colorbar import Colorbar
from matplotlib.colors import LogNorm
from matplotlib.lines import Line2D
from matplotlib.text import Annotation
from matplotlib.ticker import MultipleLocator
from numpy.typing import ArrayLike, NDArray

from vibrokit.plots.artists import Artists
from vibrokit.plots.axes import axes_or_new, colour, scientific

_PARTS = 360
_ACTION = r"action at the exit $S$ (m$^2$ s$^{-3}$)"
_BELOW = 1.4  # the axis begins at the least action divided by this: room for the numbers under the lines
_TOP = 300.0  # times the largest energy, up to which actions are shown

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class ActionPlotArtists(Artists):
    """Starts of each attractor, the `least` action where they have several radii, energies and their `numbers`."""

    starts: tuple[Line2D, ...]
    least: tuple[Line2D, ...]
    energies: tuple[Line2D, ...]
    numbers: tuple[Annotation, ...]


@dataclasses.dataclass(frozen=True, eq=False)
class ActionMapArtists(Artists):
    """`starts` of paths that found an exit, `others` that found none, and the `best`, whose action is the least."""

    others: Line2D
    starts: PathCollection
    best: Line2D | None
    colorbar: Colorbar


def action_plot(
    angles: Sequence[ArrayLike],
    radii: Sequence[ArrayLike],
    actions: Sequence[ArrayLike],
    *,
    labels: Sequence[int],
    names: Sequence[str],
    energies: Sequence[tuple[int, float]] = (),
    ax: Axes | None = None,
) -> ActionPlotArtists:
    """Draw the action of each exit against the angle of its start, on a logarithmic scale.

    Starts of all radii share the angle axis; a line follows the least action of all radii.

    Parameters
    ----------
    angles, radii, actions : sequence of array_like (count,)
        For each attractor: angle (rad), radius (from 0 to 1; 0 on a ring) and action at the exit (m² s⁻³) of each
        start. The action is NaN where there was no exit.
    labels : sequence of int
        Label of each attractor: chooses its colour.
    names : sequence of str
        Name of each attractor.
    energies : sequence of (int, float)
        Label of the attractor and value (m² s⁻³) of each energy: drawn as a horizontal line.
    ax : matplotlib.axes.Axes, optional
    """
    axes = axes_or_new(ax, 6.4, 4.4)
    starts, least = list[Line2D](), list[Line2D]()
    for label, name, angle, radius, action in zip(labels, names, angles, radii, actions, strict=True):
        several = bool(np.any(np.asarray(radius, dtype=float) > 0))
        look = {"markersize": 1.4, "alpha": 0.5} if several else {"markersize": 1.5}
        style: dict[str, Any] = {"color": colour(label), "rasterized": True, "label": f"leaving {name}", **look}
        starts += axes.plot(np.degrees(angle), np.asarray(action, dtype=float), ".", markeredgewidth=0, **style)
        if several:
            middle, lowest = _least_by_angle(np.asarray(angle, dtype=float), np.asarray(action, dtype=float))
            least += axes.plot(np.degrees(middle), lowest, color=colour(label), linewidth=0.9, label="_least")
    lines = [axes.axhline(value, color=colour(label), linewidth=0.8) for label, value in energies]
    numbers = [
        axes.annotate(
            rf"$\Delta U = {scientific(value)}$", (360, value), ha="right", va="top", fontsize=8,
            xytext=(-3, -2), textcoords="offset points", color=colour(label),
        )
        for label, value in energies
    ]  # fmt: skip
    axes.set_yscale("log")
    low, high = axes.get_ylim()
    axes.set_ylim(low / _BELOW, min(high, max((_TOP * value for _, value in energies), default=high)))
    axes.set_ylabel(_ACTION)
    _angle_axis(axes)
    if starts:
        for sample in axes.legend(handles=starts, loc="upper right", fontsize=8).legend_handles:
            if isinstance(sample, Line2D):
                sample.set(markersize=6, alpha=1.0)
    return ActionPlotArtists(axes, tuple(starts), tuple(least), tuple(lines), tuple(numbers))


def action_map(
    angle: ArrayLike, radius: ArrayLike, action: ArrayLike, *, name: str = "", ax: Axes | None = None
) -> ActionMapArtists:
    """Draw the action over the fundamental domain: where each path started, coloured by its action at the exit.

    Starts whose paths found no exit are grey. Where starts lie close the search was refined.

    Parameters
    ----------
    angle, radius, action : array_like (count,)
        Of each start, as in `action_plot`.
    name : str
        Of the attractor that is left.
    ax : matplotlib.axes.Axes, optional
    """
    axes = axes_or_new(ax, 7.2, 3.6)
    theta, r, s = (np.asarray(values, dtype=float) for values in (angle, radius, action))
    out = np.isfinite(s)
    (others,) = axes.plot(
        np.degrees(theta[~out]), r[~out], ".", color="0.85", markersize=1.0, rasterized=True, zorder=1
    )  # fmt: skip
    order = np.flatnonzero(out)[np.argsort(-s[out], kind="stable")]  # those of small action are drawn last
    least = float(s[out].min()) if out.any() else 1.0
    points = axes.scatter(
        np.degrees(theta[order]), r[order], c=s[order], s=2.5, linewidths=0, rasterized=True, cmap="viridis",
        norm=LogNorm(least, 10 * least), zorder=2,
    )  # fmt: skip
    best = None
    if out.any():
        (best,) = axes.plot(
            np.degrees(theta[order[-1]]), r[order[-1]], "o", markersize=9, markerfacecolor="none",
            markeredgecolor="black", zorder=3,
        )  # fmt: skip
    bar = axes.figure.colorbar(points, ax=axes, extend="max", pad=0.02, label=_ACTION)
    _angle_axis(axes)
    axes.set_ylim(*((0, 1) if r.any() else (-0.5, 0.5)))
    axes.set_ylabel("radius of the start (log scale, 0 to 1)")
    axes.set_title(f"leaving {name}" if name else "", fontsize=10)
    return ActionMapArtists(axes, others, points, best, bar)


def _angle_axis(axes: Axes) -> None:
    axes.set_xlim(0, 360)
    axes.set_xlabel(r"angle of the start $\theta$ (°)")
    axes.xaxis.set_major_locator(MultipleLocator(60))


def _least_by_angle(angle: Array, action: Array) -> tuple[Array, Array]:
    """Middles of equal parts of the circle, and the least action that started in each; NaN without a start."""
    part = np.minimum((angle / (2 * np.pi) * _PARTS).astype(int), _PARTS - 1)
    least = np.full(_PARTS, np.inf)
    np.minimum.at(least, part, np.where(np.isfinite(action), action, np.inf))
    return 2 * np.pi * (np.arange(_PARTS) + 0.5) / _PARTS, np.where(np.isfinite(least), least, np.nan)
