"""Pictures of most probable exit paths."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from numpy.typing import ArrayLike, NDArray

from vibrokit.plots.artists import Artists, attractor_name
from vibrokit.plots.axes import (
    ACTION,
    CROWD,
    DOTS,
    add_legend,
    axes_or_new,
    colour,
    draw,
    mark,
    named,
    panels_or_new,
    powers_of_ten,
    rows,
    span,
)
from vibrokit.plots.basins import SectionArtists, cell_samples, section_portrait

_RING: dict[str, Any] = {"linestyle": "none", "markerfacecolor": "none", "markeredgewidth": 1.1, "zorder": 8}


@dataclasses.dataclass(frozen=True, eq=False)
class ExitPathArtists(Artists):
    """The `section` under the paths, the lines or dots of each path, and the markers at both of its ends."""

    section: SectionArtists
    strands: tuple[tuple[Line2D, ...], ...]
    starts: tuple[Line2D, ...]
    ends: tuple[Line2D, ...]


@dataclasses.dataclass(frozen=True, eq=False)
class HistoryArtists(Artists):
    """Lines of each path, and its samples on the section; `ax` are the upper axes of the first path."""

    momenta: tuple[Line2D, ...]
    momentum_points: tuple[Line2D, ...]
    actions: tuple[Line2D, ...]
    action_points: tuple[Line2D, ...]


def exit_paths(
    labels: NDArray[Any],
    bounds: ArrayLike,
    points: Sequence[ArrayLike],
    paths: Sequence[ArrayLike] = (),
    *,
    sources: Sequence[int] = (),
    titles: Sequence[str] = (),
    names: Sequence[str] = (),
    curves: Sequence[bool] = (),
    saddles: Sequence[ArrayLike] = (),
    chaotic: Sequence[ArrayLike] = (),
    stable: Sequence[ArrayLike] = (),
    ax: Axes | None = None,
) -> ExitPathArtists:
    """Draw exit paths by their points on the section, over basins, saddles and stable manifolds.

    Points are joined with those one period of the attractor later, so that a path from an orbit of period m shows as m
    strands; those of paths from motion that never repeats are not joined. A ring marks the first point of each path, a
    square the last.

    Parameters
    ----------
    labels, bounds, points, names
        As in `vibrokit.plots.basins.basin_map`.
    paths : sequence of array_like (count, n)
        Points of each path on the section, x and v first.
    sources : sequence of int
        Label of the attractor that each path leaves: chooses its colour.
    titles : sequence of str, optional
        What the legend calls each path.
    curves : sequence of bool, optional
        Which paths are given as whole curves, not by their points on the section: those have no dots.
    saddles, chaotic : sequence of array_like (count, n)
        Points of saddle orbits, and samples of chaotic sets on the boundary.
    stable : sequence of array_like (count, 2)
        Branches of stable manifolds as curves.
    ax : matplotlib.axes.Axes, optional
        A legend is put beside the picture, or above axes that are given, because paths cover the axes.
    """
    axes = axes_or_new(ax, 7.6, 4.8)
    kinds = ["saddle"] * len(saddles) + ["chaotic"] * len(chaotic)
    section = section_portrait(
        labels, bounds, points, names=names, saddles=[*saddles, *chaotic], saddle_kinds=kinds, stable=stable, ax=axes
    )
    for marker, visits in zip(section.attractors, points, strict=True):
        if len(rows(visits)) > CROWD:
            marker.set(**DOTS, zorder=4)
    lines, starts, ends = list[tuple[Line2D, ...]](), list[Line2D](), list[Line2D]()
    for index, (path, source) in enumerate(zip(paths, sources, strict=True)):
        place, whole = rows(path), bool(curves) and curves[index]
        count = 1 if whole or not 0 <= source < len(points) else len(rows(points[source]))
        title = titles[index] if titles else f"exit path from {attractor_name(source, names)}"
        shape, dashes = mark(sources, index)
        style = {"color": colour(source), "marker": "" if whole else shape, "linestyle": dashes}
        lines.append(_strands(axes, place, count, title, style))
        ring = _RING | {"markersize": 9.5 + 3 * index, "markeredgecolor": colour(source)}
        starts.append(draw(axes, place[:1], marker="o", label="_more" if index else "start of a path", **ring))
        ends.append(draw(axes, place[-1:], marker="s", label="_more" if index else "end of a path", **ring))
    artists = ExitPathArtists(axes, section, tuple(lines), tuple(starts), tuple(ends))
    _add_legend(artists, ax, labels)
    return artists


def _add_legend(artists: ExitPathArtists, given: Axes | None, labels: NDArray[Any]) -> None:
    section = artists.section
    strands = (strand for some in artists.strands for strand in some)
    under = (*section.attractors, *section.stable, *section.saddles)
    handles = [*named((*under, *strands)), *cell_samples(labels), *named((*artists.starts, *artists.ends))]
    if given is None:
        add_legend(artists.ax, None, handles)
    else:
        artists.ax.legend(
            handles=handles, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncol=2, fontsize=7, frameon=False
        )  # fmt: skip


def _strands(
    axes: Axes, place: NDArray[np.float64], count: int, title: str, style: Mapping[str, Any]
) -> tuple[Line2D, ...]:
    """Join every so many points of a path; those of motion that never repeats are not joined."""
    if count > CROWD:
        lone = {"linestyle": "none", "markersize": 3.6, "markeredgewidth": 0.5, "markeredgecolor": "black"}
        return (draw(axes, place, label=title, zorder=5, **{**style, **lone}),)
    return tuple(
        draw(axes, place[first::count], label="_strand" if first else title, zorder=5, linewidth=0.9, **DOTS, **style)
        for first in range(count)
    )


def path_history(
    histories: Sequence[tuple[ArrayLike, ArrayLike, ArrayLike, ArrayLike]],
    *,
    sources: Sequence[int] = (),
    titles: Sequence[str] = (),
    period: float | None = None,
    ax: Any = None,
) -> HistoryArtists:
    """Draw the momentum p₂ and the action S along exit paths, two stacked axes for each, section points marked.

    The time axes begin where the action is 10⁻⁴ of its final value.

    Parameters
    ----------
    histories : sequence of (t, p, action, section)
        For each path: times (s), momentum p₂ (m s⁻²), action (m² s⁻³), each of shape (count,), and which of the samples
        lie on the section.
    sources : sequence of int, optional
        Label of the attractor that each path leaves: chooses its colour.
    titles : sequence of str, optional
        Title of each.
    period : float, optional
        Unit of the time axis (s), the time from one section to the next; seconds by default.
    ax : array of Axes (2, paths) or (2,), optional

    Raises
    ------
    ArgumentError
        `ax` has another number of axes.
    """
    panels = panels_or_new(ax, (2, max(1, len(histories))), (max(5.6, 4.4 * len(histories)), 4.6))
    lines: list[list[Line2D]] = [[], []]
    dots: list[list[Line2D]] = [[], []]
    for index, (t, p, action, section) in enumerate(histories):
        ink = colour(sources[index]) if sources else colour(0)
        time = np.asarray(t, dtype=float) / (period or 1.0)
        marked = np.asarray(section, dtype=int)
        reach = _reach(time, np.asarray(action, dtype=float))
        for row, values in enumerate((p, action)):
            axes, value = panels[row, index], np.asarray(values, dtype=float)
            axes.axhline(0.0, color="0.75", linewidth=0.7, zorder=0)
            lines[row] += axes.plot(time, value, color=ink, linewidth=0.9)
            dots[row] += axes.plot(
                time[marked], value[marked], "o", color=ink, markersize=3.2, markeredgecolor="white",
                markeredgewidth=0.4,
            )  # fmt: skip
            powers_of_ten(axes, "y")
            axes.set_xlim(*reach)
        upper, lower = panels[:, index]
        if titles:
            upper.set_title(titles[index], fontsize=9, pad=14)
        upper.tick_params(labelbottom=False)
        lower.set_xlabel("time $t$ (s)" if period is None else "time $t / T$ (section to section)")
    panels[0, 0].set_ylabel(r"momentum $p_2$ (m s$^{-2}$)")
    panels[1, 0].set_ylabel(ACTION)
    return HistoryArtists(panels[0, 0], *(tuple(some) for some in (lines[0], dots[0], lines[1], dots[1])))


def _reach(time: NDArray[np.float64], action: NDArray[np.float64]) -> tuple[float, float]:
    """Ends of the time axis."""
    if len(time) == 0:
        return 0.0, 1.0
    begun = np.flatnonzero(action >= 1e-4 * action[-1])  # before, p₂ and S cannot be told from 0
    return span([time[begun[0] if len(begun) else 0 :]])
