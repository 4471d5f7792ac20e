"""Basins of attraction on the section, and what lies on their boundaries."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap, to_rgb
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from numpy.typing import ArrayLike, NDArray

from vibrokit.plots.artists import Artists, attractor_name
from vibrokit.plots.axes import (
    DOTS,
    add_legend,
    axes_or_new,
    cell_image,
    colour,
    draw,
    draw_all,
    named,
    phase_plane,
    rows,
)
from vibrokit.plots.clipping import clipped

Style = dict[str, Any]

# Labels of cells that lead to no attractor, as `vibrokit.results.basins` has them, and how they look.
UNSETTLED, ESCAPED, NOT_FOLLOWED, AT_COPY = -1, -2, -3, -4
_GREY, _DARK, _CLEAR = (0.8, 0.8, 0.8, 1.0), (0.42, 0.42, 0.42, 1.0), (1.0, 1.0, 1.0, 0.0)
_PAPER = (0.96, 0.93, 0.86, 1.0)
_HATCH: Style = {"facecolor": "white", "edgecolor": "0.72", "hatch": "////", "linewidth": 0}

STABLE, UNSTABLE = "#101010", "#c4007a"
_EDGED: Style = {"linestyle": "none", "markeredgecolor": "white"}
_DOTS: Style = {"marker": "o", **DOTS}
_MARKERS: Mapping[str, Style] = {
    "periodic": {"marker": "o", "markersize": 6},
    "limit cycle": {"marker": "D", "markersize": 6},
    "equilibrium": {"marker": "s", "markersize": 6},
    "quasiperiodic": _DOTS,
    "chaotic": _DOTS,
}
_SADDLE_MARKERS: Mapping[str, Style] = {
    "saddle": {"marker": "X", "markersize": 7},
    "flip saddle": {"marker": "P", "markersize": 7},
    "repeller": {"marker": "^", "markersize": 7},
    "chaotic": _DOTS,
}


@dataclasses.dataclass(frozen=True, eq=False)
class BasinArtists(Artists):
    """The `image` of the cells, `hatching` where motion leaves the region, and the markers of the `attractors`."""

    image: AxesImage
    hatching: Rectangle | None
    attractors: tuple[Line2D, ...]


@dataclasses.dataclass(frozen=True, eq=False)
class SectionArtists(BasinArtists):
    """Also branches of `stable` and `unstable` manifolds, limit cycles as curves, and the markers of the `saddles`."""

    stable: tuple[Line2D, ...]
    unstable: tuple[Line2D, ...]
    cycles: tuple[Line2D, ...]
    saddles: tuple[Line2D, ...]


def basin_map(
    labels: NDArray[Any],
    bounds: ArrayLike,
    points: Sequence[ArrayLike],
    *,
    names: Sequence[str] = (),
    kinds: Sequence[str] = (),
    ax: Axes | None = None,
) -> BasinArtists:
    """Draw basins as pale colours and attractors as markers.

    Cells that did not settle are grey, those whose motion escaped from the region are hatched, and those that were not
    followed are dark.

    Parameters
    ----------
    labels : int array (nx, nv)
        Label of the attractor that each cell leads to; −1 not settled, −2 escaped, −3 not followed.
    bounds : array_like (2, 2)
        Bounds of x and v.
    points : sequence of array_like (count, n)
        Points of each attractor, x and v first.
    names : sequence of str, optional
        Name of each attractor; ``"attractor 0"`` and so on by default.
    kinds : sequence of str, optional
        Kind of each attractor, which chooses its marker: ``"periodic"`` (circle), ``"equilibrium"`` (square),
        ``"limit cycle"`` (diamond), ``"chaotic"`` or ``"quasiperiodic"`` (dots). All periodic by default.
    ax : matplotlib.axes.Axes, optional
    """
    axes = axes_or_new(ax, 5.4, 4.6)
    cells = np.asarray(labels)
    (x_low, x_high), (v_low, v_high) = np.asarray(bounds, dtype=float)
    shades = [(*(0.35 * np.array(to_rgb(colour(k))) + 0.65), 1.0) for k in range(len(points))]
    colours = ListedColormap([_PAPER, _DARK, _CLEAR, _GREY, *shades])
    image = cell_image(axes, cells, bounds, cmap=colours, vmin=AT_COPY - 0.5, vmax=len(points) - 0.5)
    hatching = None
    if (cells == ESCAPED).any():  # seen through the image where that is clear
        hatching = Rectangle((x_low, v_low), x_high - x_low, v_high - v_low, zorder=-1, **_HATCH)
        axes.add_patch(hatching)
    attractors: list[Line2D] = []
    for label, visits in enumerate(points):
        name = attractor_name(label, names) + (f", {kinds[label]}" if kinds else "")
        style = _EDGED | _style_of(_MARKERS, kinds, label)
        attractors.append(draw(axes, visits, color=colour(label), label=name, zorder=7, **style))
    phase_plane(axes)
    return BasinArtists(axes, image, hatching, tuple(attractors))


def section_portrait(
    labels: NDArray[Any],
    bounds: ArrayLike,
    points: Sequence[ArrayLike],
    *,
    names: Sequence[str] = (),
    kinds: Sequence[str] = (),
    saddles: Sequence[ArrayLike] = (),
    saddle_kinds: Sequence[str] = (),
    stable: Sequence[ArrayLike] = (),
    unstable: Sequence[ArrayLike] = (),
    cycles: Mapping[int, ArrayLike] | None = None,
    ax: Axes | None = None,
) -> SectionArtists:
    """Draw attractors, saddles and their manifolds over the basins: the global structure on the section.

    Parameters
    ----------
    labels, bounds, points, names, kinds
        As in `basin_map`.
    saddles : sequence of array_like (count, n)
        Points of each saddle.
    saddle_kinds : sequence of str, optional
        Kind of each, which chooses its marker: ``"saddle"`` (cross), ``"flip saddle"`` (plus), ``"repeller"``
        (triangle), ``"chaotic"`` (dots). All saddles by default.
    stable, unstable : sequence of array_like (count, 2)
        Branches of the manifolds as curves; parts outside the bounds are cut off.
    cycles : dict of int to array_like (count, 2), optional
        Limit cycles as curves, by label of the attractor.
    ax : matplotlib.axes.Axes, optional
        A legend is put beside the picture, or inside axes that are given.
    """
    axes = axes_or_new(ax, 7.0, 4.8)
    box = np.asarray(bounds, dtype=float)
    basins = basin_map(labels, box, points, names=names, kinds=kinds, ax=axes)
    inwards, outwards = (
        draw_all(axes, [clipped(curve, box) for curve in curves], name, color=ink, linewidth=0.8, zorder=3)
        for curves, name, ink in ((stable, "stable manifold", STABLE), (unstable, "unstable manifold", UNSTABLE))
    )
    loops = tuple(
        draw(axes, curve, color=colour(label), linewidth=1.4, zorder=4, label="_cycle")
        for label, curve in (cycles or {}).items()
    )
    marks = _draw_saddles(axes, saddles, saddle_kinds)
    axes.set_xlim(*box[0])
    axes.set_ylim(*box[1])
    add_legend(axes, ax, [*named((*basins.attractors, *inwards, *outwards, *marks)), *cell_samples(labels)])
    return SectionArtists(axes, basins.image, basins.hatching, basins.attractors, inwards, outwards, loops, marks)


def _draw_saddles(axes: Axes, saddles: Sequence[ArrayLike], kinds: Sequence[str]) -> tuple[Line2D, ...]:
    marks: list[Line2D] = []
    for index, visits in enumerate(saddles):
        kind = kinds[index] if kinds else "saddle"
        name = "chaotic saddle" if kind == "chaotic" else kind
        style = _EDGED | _style_of(_SADDLE_MARKERS, kinds, index)
        if len(rows(visits)) > 4 and kind != "chaotic":  # so that many points do not hide what they lie on
            style |= {"markersize": 4, "markeredgewidth": 0.4}
        label = "_more" if kind in kinds[:index] or (index and not kinds) else name
        marks.append(draw(axes, visits, color="black", zorder=6, label=label, **style))
    return tuple(marks)


def _style_of(markers: Mapping[str, Style], kinds: Sequence[str], index: int) -> Style:
    """Marker of a kind; that of the first kind if none is given or it is unknown."""
    usual = next(iter(markers))
    return markers.get(kinds[index] if kinds else usual, markers[usual])


def cell_samples(cells: NDArray[Any]) -> list[Patch]:
    """Entries of the legend for cells that lead to no attractor, if there are any."""
    samples = (
        (UNSETTLED, {"facecolor": _GREY}, "not settled"),
        (ESCAPED, _HATCH, "leaves the region"),
        (AT_COPY, {"facecolor": _PAPER}, "copy, turns away"),
        (NOT_FOLLOWED, {"facecolor": _DARK}, "not followed"),
    )
    return [
        Patch(**{"linewidth": 0, **style}, label=name)
        for label, style, name in samples
        if (np.asarray(cells) == label).any()
    ]
