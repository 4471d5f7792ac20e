"""Pictures of activation energies along a parameter."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from numpy.typing import ArrayLike

from vibrokit.plots.artists import Artists
from vibrokit.plots.axes import add_legend, axes_or_new, colour

_STYLES = ("-", "--", ":", "-.")


@dataclasses.dataclass(frozen=True, eq=False)
class EnergyCurveArtists(Artists):
    """A curve for each path."""

    curves: tuple[Line2D, ...]


def energy_curves(
    values: ArrayLike,
    actions: Sequence[ArrayLike],
    names: Sequence[str],
    *,
    groups: Sequence[int],
    label: str,
    ax: Axes | None = None,
) -> EnergyCurveArtists:
    """Draw the actions of exit paths against a parameter, on a logarithmic scale; gaps where a path is not known.

    Parameters
    ----------
    values : array_like (count,)
        The parameter's values.
    actions : sequence of array_like (count,)
        One for each path (m² s⁻³).
    names : sequence of str
        What the legend calls each path.
    groups : sequence of int
        Group of each path, such as the attractor that it leaves: those of one group have one colour and different
        lines.
    label : str
        Symbol and unit of the parameter.
    ax : matplotlib Axes, optional
        A legend is put beside the picture, or inside axes that are given.

    Returns
    -------
    EnergyCurveArtists
    """
    axes = axes_or_new(ax, 7.0, 4.4)
    curves: list[Line2D] = []
    for number, (action, name, group) in enumerate(zip(actions, names, groups, strict=True)):
        style = _STYLES[list(groups[:number]).count(group) % len(_STYLES)]
        curves += axes.plot(
            np.asarray(values, dtype=float), np.asarray(action, dtype=float), style, color=colour(group), label=name,
            marker="o", markersize=2.5, linewidth=1.2,
        )  # fmt: skip
    if curves:
        axes.set_yscale("log")
    axes.locator_params(axis="x", nbins=5)
    axes.set_xlabel(label)
    axes.set_ylabel(r"action $S$ (m$^2$ s$^{-3}$)")
    add_legend(axes, ax, curves)
    return EnergyCurveArtists(axes, tuple(curves))
