"""Pictures of what changes with a parameter."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.lines import Line2D
from numpy.typing import ArrayLike

from vibrokit.plots.artists import Artists
from vibrokit.plots.axes import ACTION, add_legend, axes_or_new, colour, named

_MARKS: Mapping[str, Mapping[str, Any]] = {
    "fold": {"marker": "s", "color": "black"},
    "pitchfork or transcritical": {"marker": "P", "color": "black"},
    "period doubling": {"marker": "v", "color": "black"},
    "Neimark–Sacker": {"marker": "D", "color": "black"},
    "Hopf": {"marker": "o", "color": "black"},
    "grazing": {"marker": "*", "color": "#c4007a", "markersize": 11},
}
_OTHER_MARKS = ("^", "<", ">", "h", "d", "X")


@dataclasses.dataclass(frozen=True, eq=False)
class BifurcationArtists(Artists):
    """Points of each branch; `marks` of bifurcations kind by kind: one for those with an x, one for each without."""

    branches: tuple[Line2D, ...]
    marks: tuple[Line2D, ...]


@dataclasses.dataclass(frozen=True, eq=False)
class FractionArtists(Artists):
    """The area of each branch, and what leads to none of them, if that does not vanish."""

    areas: tuple[PolyCollection, ...]
    remainder: PolyCollection | None


def bifurcation_diagram(
    values: ArrayLike,
    x: ArrayLike,
    branches: ArrayLike,
    marks: Sequence[tuple[str, float, float]] = (),
    *,
    names: Sequence[str] = (),
    label: str,
    ax: Axes | None = None,
) -> BifurcationArtists:
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
    names : sequence of str, optional
        What the legend calls each branch, by number; ``"branch 0"`` and so on by default.
    label : str
        Symbol and unit of the parameter, such as ``r"forcing frequency $\\omega$ (rad s$^{-1}$)"``.
    ax : matplotlib.axes.Axes, optional
        A legend is put beside the picture, or inside axes that are given.
    """
    axes = axes_or_new(ax, 7.0, 4.4)
    value, place, branch = (np.ravel(np.asarray(array)) for array in (values, x, branches))
    lines: list[Line2D] = []
    for number in np.unique(branch):
        own = branch == number
        size, name = 3.0 if own.sum() < 1000 else 1.0, names[number] if number < len(names) else f"branch {number}"
        lines += axes.plot(
            value[own], place[own], ".", markersize=size, color=colour(int(number)), label=name,
            rasterized=own.sum() > 10_000,
        )  # fmt: skip
    drawn: list[Line2D] = []
    for index, kind in enumerate(dict.fromkeys(kind for kind, _, _ in marks)):
        drawn += _draw_marks(axes, kind, index, np.array([(a, b) for k, a, b in marks if k == kind], dtype=float))
    axes.set_xlabel(label)
    axes.set_ylabel(r"displacement on the section $x$ (m)")
    add_legend(axes, ax, named((*lines, *drawn)))
    return BifurcationArtists(axes, tuple(lines), tuple(drawn))


def _draw_marks(axes: Axes, kind: str, index: int, at: Any) -> list[Line2D]:
    style = _MARKS.get(kind, {"marker": _OTHER_MARKS[index % len(_OTHER_MARKS)], "color": "black"})
    placed = at[np.isfinite(at[:, 1])]
    marks: list[Line2D] = []
    if len(placed):
        marks += axes.plot(
            placed[:, 0], placed[:, 1], linestyle="none", label=kind, zorder=5,
            **{"markersize": 7, "markeredgecolor": "white", **style},
        )  # fmt: skip
    for number, value in enumerate(at[~np.isfinite(at[:, 1]), 0]):
        name = "_more" if number or len(placed) else kind
        marks.append(axes.axvline(value, color=style["color"], linewidth=0.8, linestyle=":", label=name, zorder=1))
    return marks


def basin_fractions(
    values: ArrayLike,
    fractions: ArrayLike,
    names: Sequence[str],
    *,
    label: str,
    branches: Sequence[int] | None = None,
    ax: Axes | None = None,
) -> FractionArtists:
    """Draw shares of the region against a parameter as stacked areas.

    Parameters
    ----------
    values : array_like (count,)
        The parameter's values, in any order; an area needs at least two.
    fractions : array_like (branches, count)
        Share of the region that leads to each branch; 0 or NaN where it does not exist. Where all are NaN, nothing is
        known, and the areas have a gap.
    names : sequence of str
        What the legend calls each branch.
    label : str
        Symbol and unit of the parameter.
    branches : sequence of int, optional
        Number of each branch, which chooses its colour; in order from 0 by default.
    ax : matplotlib.axes.Axes, optional
        A legend is put beside the picture, or inside axes that are given.
    """
    axes = axes_or_new(ax, 7.0, 4.0)
    order = np.argsort(np.ravel(np.asarray(values, dtype=float)), kind="stable")
    value = np.ravel(np.asarray(values, dtype=float))[order]
    given = np.asarray(fractions, dtype=float).reshape(len(names), len(value))[:, order]
    share = np.where(np.isnan(given).all(axis=0), np.nan, np.nan_to_num(given))
    tops = np.cumsum(share, axis=0)
    numbers = range(len(names)) if branches is None else branches
    areas = tuple(
        axes.fill_between(value, top - part, top, color=colour(number), alpha=0.7, linewidth=0, label=name)
        for number, name, top, part in zip(numbers, names, tops, share, strict=True)
    )
    reached = tops[-1] if len(names) else np.zeros(len(value))
    remainder = None
    if (reached < 1 - 1e-9).any():
        remainder = axes.fill_between(value, reached, 1.0, color="0.85", linewidth=0, label="none of these")
    axes.set_ylim(0, 1)
    if len(value) > 1 and value[-1] > value[0]:
        axes.set_xlim(value[0], value[-1])
    axes.set_xlabel(label)
    axes.set_ylabel("share of the region")
    add_legend(axes, ax, [*areas, *([] if remainder is None else [remainder])])
    return FractionArtists(axes, areas, remainder)


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
    ax : matplotlib.axes.Axes, optional
        A legend is put beside the picture, or inside axes that are given.
    """
    axes = axes_or_new(ax, 7.0, 4.4)
    curves: list[Line2D] = []
    for number, (action, name, group) in enumerate(zip(actions, names, groups, strict=True)):
        style = ("-", "--", ":", "-.")[list(groups[:number]).count(group) % 4]
        curves += axes.plot(
            np.asarray(values, dtype=float), np.asarray(action, dtype=float), style, color=colour(group), label=name,
            marker="o", markersize=2.5, linewidth=1.2,
        )  # fmt: skip
    if curves:
        axes.set_yscale("log")
    axes.locator_params(axis="x", nbins=5)
    axes.set_xlabel(label)
    axes.set_ylabel(ACTION)
    add_legend(axes, ax, curves)
    return EnergyCurveArtists(axes, tuple(curves))
