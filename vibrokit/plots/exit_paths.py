"""Pictures of most probable exit paths."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

from vibrokit.plots.axes import add_legend, axes_or_new, colour, named, rows, span
from vibrokit.plots.basins import cell_samples, section_portrait

_BEGUN = 1e-4  # of the whole action
_MOST_STRANDS = 32  # points of an attractor above which those of a path are not joined: it is no orbit
_DOTS: Mapping[str, Any] = {"markersize": 2.2, "markeredgewidth": 0}
_LONE_DOTS: Mapping[str, Any] = {"markersize": 3.6, "markeredgewidth": 0.5, "markeredgecolor": "black"}
_ENDS = ("start of a path", "end of a path")
_DASHES = ("-", (0, (4, 1.5)), (0, (1.2, 1.2)), (0, (5, 1.5, 1.2, 1.5)))


def exit_paths(
    labels: NDArray[Any],
    bounds: ArrayLike,
    points: Sequence[ArrayLike],
    paths: Sequence[ArrayLike] = (),
    *,
    sources: Sequence[int] = (),
    names: Sequence[str] = (),
    curves: Sequence[bool] = (),
    saddles: Sequence[ArrayLike] = (),
    chaotic: Sequence[ArrayLike] = (),
    stable: Sequence[ArrayLike] = (),
    ax: Axes | None = None,
) -> list[Any]:
    """Draw exit paths by their points on the section, over basins, saddles and stable manifolds.

    Points are joined with those a period of the attractor later, so that a path from an orbit of period m shows as m
    strands; those of paths from motion that never repeats are not joined. A ring marks the first point of each path, a
    square the last.

    Parameters
    ----------
    labels, bounds, points
        As in `vibrokit.plots.basins.basin_map`.
    paths : sequence of array_like (count, n)
        Points of each path on the section, x and v first.
    sources : sequence of int
        Label of the attractor that each path leaves: chooses its colour.
    names : sequence of str, optional
        What each path is called in the legend.
    curves : sequence of bool, optional
        Which paths are given all along, not by their points on the section: those have no dots.
    saddles, chaotic : sequence of array_like (count, n)
        Points of saddle orbits, and samples of chaotic sets on the boundary.
    stable : sequence of array_like (count, 2)
        Branches of stable manifolds as curves.
    ax : matplotlib Axes, optional
        A legend is put beside the picture, or above axes that are given: paths go everywhere.

    Returns
    -------
    list of artists
        Those of `section_portrait`, then the strands, start and end of each path.
    """
    axes = axes_or_new(ax, 7.6, 4.8)
    crowds = {f"attractor {label}" for label, visits in enumerate(points) if len(rows(visits)) > _MOST_STRANDS}
    kinds = ["saddle"] * len(saddles) + ["chaotic"] * len(chaotic)
    artists = section_portrait(
        labels, bounds, points, saddles=[*saddles, *chaotic], saddle_kinds=kinds, stable=stable, ax=axes
    )
    for artist in artists[1:]:
        if artist.get_label() in crowds:
            artist.set(**_DOTS, zorder=4)
    for index, (path, source) in enumerate(zip(paths, sources, strict=True)):
        place = rows(path)
        strands = len(rows(points[source])) if 0 <= source < len(points) else 1
        name = names[index] if names else f"exit path from {source}"
        dashes = _DASHES[list(sources[:index]).count(source) % len(_DASHES)]
        whole = bool(curves) and curves[index]
        artists += _draw_path(axes, place, 1 if whole else strands, index, colour(source), dashes, name)
        if whole:
            artists[-3].set_marker("")
    _add_legend(axes, ax, [*named(artists), *cell_samples(np.asarray(labels))])
    return artists


def _add_legend(axes: Axes, given: Axes | None, handles: Sequence[Any]) -> None:
    handles = sorted(handles, key=lambda handle: handle.get_label() in _ENDS)
    if given is None:
        add_legend(axes, None, handles)
        return
    axes.legend(handles=handles, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncol=2, fontsize=7, frameon=False)


def _draw_path(
    axes: Axes, place: NDArray[np.float64], strands: int, index: int, ink: str, dashes: Any, name: str
) -> list[Any]:  # fmt: skip
    joined = strands <= _MOST_STRANDS
    style = _DOTS if joined else _LONE_DOTS
    artists: list[Any] = []
    for first in range(strands if joined else 1):
        some = place[first::strands] if joined else place
        artists += axes.plot(
            some[:, 0], some[:, 1], linestyle=dashes if joined else "none", linewidth=0.9, color=ink, marker="o",
            zorder=5, label="_strand" if first else name, **style,
        )  # fmt: skip
    for some, marker, word in ((place[:1], "o", _ENDS[0]), (place[-1:], "s", _ENDS[1])):
        artists += axes.plot(
            some[:, 0], some[:, 1], marker, markersize=9.5 + 3 * index, markerfacecolor="none", markeredgecolor=ink,
            markeredgewidth=1.1, zorder=8, label="_more" if index else word,
        )  # fmt: skip
    return artists


def path_history(
    histories: Sequence[tuple[ArrayLike, ArrayLike, ArrayLike, ArrayLike]],
    *,
    sources: Sequence[int] = (),
    names: Sequence[str] = (),
    period: float | None = None,
    ax: Any = None,
) -> list[Any]:
    """Draw the momentum p₂ and the action S along exit paths, two stacked axes for each, section points marked.

    The axes begin where the action is a ten-thousandth of what it is in the end: before that there is nothing to see.

    Parameters
    ----------
    histories : sequence of (t, p, action, section)
        For each path: times (s), momentum p₂ (m s⁻²), action (m² s⁻³), each of shape (count,), and which of the samples
        lie on the section.
    sources : sequence of int, optional
        Label of the attractor that each path leaves: chooses its colour.
    names : sequence of str, optional
        Title of each.
    period : float, optional
        Unit of the time axis (s), the time from one section to the next; seconds by default.
    ax : array of Axes (2, paths) or (2,), optional

    Returns
    -------
    list of artists
        For each path: line and dots of p₂, line and dots of S.
    """
    panels = _panels(ax, len(histories))
    artists: list[Any] = []
    for index, (t, p, action, section) in enumerate(histories):
        ink = colour(sources[index]) if sources else colour(0)
        time = np.asarray(t, dtype=float) / (period or 1.0)
        marked = np.asarray(section, dtype=int)
        upper, lower = panels[:, index]
        for axes, values in ((upper, p), (lower, action)):
            value = np.asarray(values, dtype=float)
            axes.axhline(0.0, color="0.75", linewidth=0.7, zorder=0)
            artists += axes.plot(time, value, color=ink, linewidth=0.9)
            artists += axes.plot(
                time[marked], value[marked], "o", color=ink, markersize=3.2, markeredgecolor="white",
                markeredgewidth=0.4,
            )  # fmt: skip
            axes.ticklabel_format(axis="y", style="sci", scilimits=(-2, 3), useMathText=True)
        if names:
            upper.set_title(names[index], fontsize=9, pad=14)
        upper.tick_params(labelbottom=False)
        reach = _reach(time, np.asarray(action, dtype=float))
        upper.set_xlim(*reach)
        lower.set_xlim(*reach)
        lower.set_xlabel("time $t$ (s)" if period is None else "time $t / T$ (section to section)")
        if index == 0:
            upper.set_ylabel(r"momentum $p_2$ (m s$^{-2}$)")
            lower.set_ylabel(r"action $S$ (m$^2$ s$^{-3}$)")
    return artists


def _reach(time: NDArray[np.float64], action: NDArray[np.float64]) -> tuple[float, float]:
    """Ends of the time axis."""
    if len(time) == 0:
        return 0.0, 1.0
    begun = np.flatnonzero(action >= _BEGUN * action[-1])
    return span([time[begun[0] if len(begun) else 0 :]])


def _panels(ax: Any, count: int) -> NDArray[Any]:
    if ax is not None:
        return np.asarray(ax, dtype=object).reshape(2, -1)
    figure = Figure(figsize=(max(5.6, 4.4 * count), 4.6), layout="constrained")
    return figure.subplots(2, max(1, count), squeeze=False)
