"""Pictures of what changes with a parameter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike

from vibrokit.plots.axes import add_legend, axes_or_new, colour, named

_MARKS: Mapping[str, Mapping[str, Any]] = {
    "fold": {"marker": "s", "color": "black"},
    "pitchfork or transcritical": {"marker": "P", "color": "black"},
    "period doubling": {"marker": "v", "color": "black"},
    "Neimark–Sacker": {"marker": "D", "color": "black"},
    "Hopf": {"marker": "o", "color": "black"},
    "grazing": {"marker": "*", "color": "#c4007a", "markersize": 11},
}
_OTHER_MARKS = ("^", "<", ">", "h", "d", "X")


def bifurcation_diagram(
    values: ArrayLike,
    x: ArrayLike,
    branches: ArrayLike,
    marks: Sequence[tuple[str, float, float]] = (),
    *,
    label: str,
    ax: Axes | None = None,
) -> list[Any]:
    """Draw the points of steady states on the section against a parameter, with the bifurcations marked.

    Parameters
    ----------
    values : array_like (count,)
        The parameter's value of each point.
    x : array_like (count,)
        Displacement of the point (m).
    branches : array_like of int (count,)
        Branch that each point belongs to: chooses its colour, the same as the attractor's of that label.
    marks : sequence of (str, float, float)
        Kind of each bifurcation (``"grazing"``, ``"period doubling"``, ``"fold"``, …), the parameter's value there, and
        x on the section; with x = NaN, a line marks the value alone.
    label : str
        Symbol and unit of the parameter, such as ``r"forcing frequency $\\omega$ (rad s$^{-1}$)"``.
    ax : matplotlib Axes, optional
        A legend is put beside the picture, or inside axes that are given.

    Returns
    -------
    list of artists
        A line of dots for each branch, in order of their numbers; then the marks, kind by kind, one artist for those
        with an x and one for each without.
    """
    axes = axes_or_new(ax, 7.0, 4.4)
    value, place, branch = (np.ravel(np.asarray(array)) for array in (values, x, branches))
    artists: list[Any] = []
    for number in np.unique(branch):
        own = branch == number
        size = 3.0 if own.sum() < 1000 else 1.0
        artists += axes.plot(
            value[own], place[own], ".", markersize=size, color=colour(int(number)), label=f"branch {number}",
            rasterized=own.sum() > 10_000,
        )  # fmt: skip
    for index, kind in enumerate(dict.fromkeys(kind for kind, _, _ in marks)):
        artists += _draw_marks(axes, kind, index, np.array([(a, b) for k, a, b in marks if k == kind], dtype=float))
    axes.set_xlabel(label)
    axes.set_ylabel(r"displacement on the section $x$ (m)")
    add_legend(axes, ax, named(artists))
    return artists


def _draw_marks(axes: Axes, kind: str, index: int, at: Any) -> list[Any]:
    style = _MARKS.get(kind, {"marker": _OTHER_MARKS[index % len(_OTHER_MARKS)], "color": "black"})
    placed = at[np.isfinite(at[:, 1])]
    artists: list[Any] = []
    if len(placed):
        artists += axes.plot(
            placed[:, 0], placed[:, 1], linestyle="none", label=kind, zorder=5,
            **{"markersize": 7, "markeredgecolor": "white", **style},
        )  # fmt: skip
    for number, value in enumerate(at[~np.isfinite(at[:, 1]), 0]):
        name = "_more" if number or len(placed) else kind
        artists.append(axes.axvline(value, color=style["color"], linewidth=0.8, linestyle=":", label=name, zorder=1))
    return artists


def basin_fractions(
    values: ArrayLike,
    fractions: ArrayLike,
    names: Sequence[str],
    *,
    label: str,
    branches: Sequence[int] | None = None,
    ax: Axes | None = None,
) -> list[Any]:
    """Draw shares of the region against a parameter as areas, one on the other.

    Parameters
    ----------
    values : array_like (count,)
        The parameter's values, in any order; an area takes two or more.
    fractions : array_like (branches, count)
        Share of the region that leads to each branch; 0 or NaN where it is not there. Where all are NaN, nothing is
        known, and the areas have a gap.
    names : sequence of str
        What each branch is called in the legend.
    label : str
        Symbol and unit of the parameter.
    branches : sequence of int, optional
        Number of each branch, which chooses its colour; in order from 0 by default.
    ax : matplotlib Axes, optional
        A legend is put beside the picture, or inside axes that are given.

    Returns
    -------
    list of artists
        The area of each branch; last, if it does not vanish, what leads to none of them.
    """
    axes = axes_or_new(ax, 7.0, 4.0)
    order = np.argsort(np.ravel(np.asarray(values, dtype=float)), kind="stable")
    value = np.ravel(np.asarray(values, dtype=float))[order]
    given = np.asarray(fractions, dtype=float).reshape(len(names), len(value))[:, order]
    share = np.where(np.isnan(given).all(axis=0), np.nan, np.nan_to_num(given))
    tops = np.cumsum(share, axis=0)
    numbers = range(len(names)) if branches is None else branches
    artists: list[Any] = []
    for number, name, top, part in zip(numbers, names, tops, share, strict=True):
        area = axes.fill_between(value, top - part, top, color=colour(number), alpha=0.7, linewidth=0, label=name)
        artists.append(area)
    reached = tops[-1] if len(names) else np.zeros(len(value))
    if (reached < 1 - 1e-9).any():
        artists.append(axes.fill_between(value, reached, 1.0, color="0.85", linewidth=0, label="none of these"))
    axes.set_ylim(0, 1)
    if len(value) > 1 and value[-1] > value[0]:
        axes.set_xlim(value[0], value[-1])
    axes.set_xlabel(label)
    axes.set_ylabel("share of the region")
    add_legend(axes, ax, artists)
    return artists
