"""Axes, colours and legends that all pictures share."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from numpy.typing import ArrayLike, NDArray

from vibrokit.errors import ArgumentError, shown

COLOURS = (
    "#3b6ea8", "#c8553d", "#588b5b", "#8e6bb0", "#c9a227", "#7a4b2a", "#d679a8", "#4aa3a2", "#1f3a5f", "#e08e45",
    "#9bbf3b", "#5b2a6e", "#6fb1e0", "#8c1c2f", "#0f6b4f", "#b58bd6", "#d9c56b", "#a66a52", "#e8a0a0", "#2b8fb3",
)  # fmt: skip
MARKS = "osD^vP*X"
DOTS: Mapping[str, Any] = {"markersize": 2.2, "markeredgewidth": 0}  # of a sample of points
CROWD = 32  # points above which they are a sample of motion that never repeats, or as crowded as one
DENSE = 20_000  # points of a curve above which it is drawn as pixels
DASHES = ("-", (0, (4, 2)), (0, (1, 1.5)), (0, (5, 1.5, 1, 1.5)))
DISPLACEMENT, VELOCITY = r"displacement $x$ (m)", r"velocity $v$ (m s$^{-1}$)"
ACTION = r"action $S$ (m$^2$ s$^{-3}$)"


def axes_or_new(ax: Axes | None, width: float = 6.0, height: float = 4.2) -> Axes:
    """Return `ax`, or the axes of a new figure that belongs to no window."""
    if ax is not None:
        if not isinstance(ax, Axes):
            raise ArgumentError(f"ax must be the axes of a Matplotlib figure, or None for new ones, got {shown(ax)}.")
        return ax
    return Figure(figsize=(width, height), layout="constrained").add_subplot()


def panels_or_new(ax: Any, shape: tuple[int, int], size: tuple[float, float]) -> NDArray[Any]:
    """Return given axes as an array of a shape, or those of a new figure, which share the abscissa of each column.

    Raises
    ------
    ArgumentError
        `ax` has another number of axes.
    """
    if ax is None:
        return Figure(figsize=size, layout="constrained").subplots(*shape, sharex="col", squeeze=False)
    given = np.asarray(ax, dtype=object)
    if given.size != shape[0] * shape[1]:
        raise ArgumentError(f"ax has {given.size} axes; give an array of shape {shape}, one for each panel, or None.")
    return given.reshape(shape)


def colour(label: int) -> str:
    """Return the colour of an attractor, the same in all pictures."""
    return COLOURS[label % len(COLOURS)]


def mark(labels: Sequence[int], index: int) -> tuple[str, Any]:
    """Return the marker and the dashes of one of several things, which differ for those of the same label."""
    place = list(labels[:index]).count(labels[index])
    return MARKS[place % len(MARKS)], DASHES[place % len(DASHES)]


def rows(points: ArrayLike) -> NDArray[np.float64]:
    """Return points as an array (count, n), with two columns if there are none."""
    array = np.asarray(points, dtype=float)
    return array.reshape(len(array), -1) if array.size else np.empty((0, 2))


def draw(ax: Axes, points: ArrayLike, **style: Any) -> Line2D:
    """Draw points or a curve, x and v first; return the line."""
    place = rows(points)
    (line,) = ax.plot(place[:, 0], place[:, 1], rasterized=len(place) > DENSE, **style)
    return line


def draw_all(ax: Axes, curves: Iterable[ArrayLike], name: str, **style: Any) -> tuple[Line2D, ...]:
    """Draw curves of one kind, of which the legend names the first; return the lines."""
    return tuple(draw(ax, curve, label="_more" if k else name, **style) for k, curve in enumerate(curves))


def cell_image(ax: Axes, values: NDArray[Any], bounds: ArrayLike, **style: Any) -> AxesImage:
    """Draw an array (nx, nv) of cells as an image between bounds of x and v."""
    extent: Any = tuple(np.asarray(bounds, dtype=float).ravel())
    return ax.imshow(values.T, origin="lower", extent=extent, aspect="auto", interpolation="nearest", **style)


def phase_plane(ax: Axes) -> None:
    """Label the axes with displacement and velocity; very small and very large numbers have a common power of ten."""
    powers_of_ten(ax)
    ax.locator_params(axis="x", nbins=6)
    ax.set_xlabel(DISPLACEMENT)
    ax.set_ylabel(VELOCITY)


def powers_of_ten(ax: Axes, axis: Literal["both", "x", "y"] = "both", largest: int = 3) -> None:
    """Give numbers below 0.01, and those from 10 to the power `largest` on, a common power of ten."""
    ax.ticklabel_format(axis=axis, style="sci", scilimits=(-2, largest), useMathText=True)


def legend_inside(ax: Axes, artists: Iterable[Any]) -> Legend | None:
    """Add a legend without a frame of what has a name, if anything has."""
    handles = named(artists)
    return ax.legend(handles=handles, fontsize=8, frameon=False) if handles else None


def add_legend(ax: Axes, given: Axes | None, handles: Sequence[Any]) -> None:
    """Add a legend: beside the axes of a new figure, or inside axes that were given, where there is most room."""
    if not handles:
        return
    if given is None:
        legend = ax.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize=8, frameon=False)
    else:
        legend = ax.legend(handles=handles, loc="best", fontsize=7, framealpha=0.85)
    for sample in legend.legend_handles:
        if isinstance(sample, Line2D):  # a dot too small to show its colour is drawn larger here
            sample.set_markersize(max(4.0, sample.get_markersize()))
            sample.set_linewidth(max(1.0, sample.get_linewidth()))


def scientific(value: float) -> str:
    """Return a number with a power of ten, as mathematics in a text of Matplotlib."""
    mantissa, _, exponent = f"{value:.3e}".partition("e")
    return rf"{mantissa} \times 10^{{{int(exponent)}}}" if exponent else mantissa


def named(artists: Iterable[Any]) -> list[Any]:
    """Return the artists that have a name for the legend."""
    return [artist for artist in artists if artist.get_label() and not str(artist.get_label()).startswith("_")]


def span(values: Sequence[Any]) -> tuple[float, float]:
    """Return the least and the largest finite number of some arrays, with a little room around; (−1, 1) if none."""
    flat = np.concatenate([np.ravel(np.asarray(value, dtype=float)) for value in values] or [np.empty(0)])
    finite = flat[np.isfinite(flat)]
    if finite.size == 0:
        return -1.0, 1.0
    low, high = float(finite.min()), float(finite.max())
    resting = high - low <= 1e-9 * max(1.0, abs(high))  # the width is rounding
    room = 0.1 * max(1.0, abs(high)) if resting else 0.06 * (high - low)
    return low - room, high + room
