"""Pictures of mean exit times against the noise intensity."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Sequence
from typing import Annotated, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.container import ErrorbarContainer
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from numpy.typing import ArrayLike, NDArray

from vibrokit.documented import documented
from vibrokit.plots.artists import Artists
from vibrokit.plots.axes import DASHES, MARKS, axes_or_new, colour, legend_inside, mark, powers_of_ten, span

_FILLS = ("none", "full", "left", "bottom", "right", "top")
_POINTS: dict[str, Any] = {"marker": "o", "markersize": 4.5, "capsize": 2.5, "linewidth": 1.0}


@documented
@dataclasses.dataclass(frozen=True, eq=False)
class ExitTimes:
    """Mean exit times of one exit at several noise intensities."""

    intensities: Annotated[ArrayLike, "noise intensities D (m² s⁻³)"]
    log_times: Annotated[ArrayLike, "ln τ at each, τ in s"]
    errors: Annotated[ArrayLike, "error estimates of ln τ"]
    label: Annotated[int, "label of the attractor that is left: chooses the colour"] = 0
    title: Annotated[str, "what the legend calls the exit"] = ""
    place: Annotated[int, "among the exits of one attractor: chooses how markers are filled and lines are dashed"] = 0

    def in_order(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Return 1/D in ascending order, ln τ and its errors."""
        inverse = 1.0 / np.asarray(self.intensities, dtype=float)
        order = np.argsort(inverse)
        return inverse[order], np.asarray(self.log_times, float)[order], np.asarray(self.errors, float)[order]


@dataclasses.dataclass(frozen=True)
class ArrheniusLine:
    """ln τ = logarithm + energy/D of one exit; label, title and place as of `ExitTimes`."""

    energy: float
    logarithm: float
    label: int = 0
    title: str = ""
    place: int = 0


@dataclasses.dataclass(frozen=True, eq=False)
class ExitTimeArtists(Artists):
    """Points of each exit."""

    points: tuple[ErrorbarContainer, ...]
    legend: Legend | None


@dataclasses.dataclass(frozen=True, eq=False)
class SlopeArtists(Artists):
    """Points of each exit with two intensities or more; activation energies, and what lies between their `bounds`."""

    points: tuple[ErrorbarContainer, ...]
    limits: tuple[Line2D, ...]
    bounds: tuple[Rectangle, ...]
    legend: Legend | None


@dataclasses.dataclass(frozen=True, eq=False)
class ReconciliationArtists(Artists):
    """Points of each exit and method; a line of slope ΔU for each exit with an energy."""

    points: tuple[ErrorbarContainer, ...]
    lines: tuple[Line2D, ...]
    legend: Legend | None


def exit_times(exits: Sequence[ExitTimes], *, ax: Axes | None = None) -> ExitTimeArtists:
    """Draw ln τ against 1/D, with error bars. The slope tends to the activation energy as D → 0.

    Parameters
    ----------
    exits : sequence of ExitTimes
    ax : matplotlib.axes.Axes, optional
    """
    axes = axes_or_new(ax)
    labels, points = [one.label for one in exits], []
    for index, one in enumerate(exits):
        inverse, log_times, errors = one.in_order()
        marker, dashes = mark(labels, index)
        style = {**_POINTS, "marker": marker, "linestyle": dashes, "color": colour(one.label)}
        points.append(axes.errorbar(inverse, log_times, errors, label=one.title, **style))
    _label_times(axes)
    return ExitTimeArtists(axes, tuple(points), legend_inside(axes, points))


def reconciled_times(
    exits: Sequence[ExitTimes],
    methods: Sequence[str],
    lines: Sequence[ArrheniusLine] = (),
    *,
    ax: Axes | None = None,
) -> ReconciliationArtists:
    """Draw ln τ against 1/D by several methods, each with its marker, and lines of slope ΔU.

    Parameters
    ----------
    exits : sequence of ExitTimes
    methods : sequence of str
        The method of each, which chooses its marker.
    lines : sequence of ArrheniusLine
        Drawn over all 1/D.
    ax : matplotlib.axes.Axes, optional
    """
    axes = axes_or_new(ax, width=7.0, height=4.8)
    markers = dict(zip(dict.fromkeys(methods), itertools.cycle(MARKS)))
    points, drawn, places = list[ErrorbarContainer](), list[Line2D](), list[float]()
    for one, method in zip(exits, methods, strict=True):
        inverse, log_times, errors = one.in_order()
        fill = _FILLS[one.place % len(_FILLS)]
        style = {**_POINTS, "marker": markers[method], "linestyle": "none", "fillstyle": fill, "markersize": 6.5}
        points.append(axes.errorbar(inverse, log_times, errors, color=colour(one.label), label=one.title, **style))
        places += inverse.tolist()
    if places:
        across = np.linspace(min(places), max(places), 2)
        for line in lines:
            style = {"color": colour(line.label), "linestyle": DASHES[line.place % len(DASHES)], "linewidth": 1.1}
            drawn += axes.plot(across, line.logarithm + line.energy * across, label=line.title, **style)
    _label_times(axes)
    return ReconciliationArtists(axes, tuple(points), tuple(drawn), legend_inside(axes, [*points, *drawn]))


def _label_times(axes: Axes) -> None:
    axes.set_xlabel(r"inverse noise intensity $1/D$ (m$^{-2}$ s$^{3}$)")
    axes.set_ylabel(r"mean exit time $\ln(\tau / 1\,\mathrm{s})$")
    powers_of_ten(axes, "x", largest=4)


def exit_slopes(
    exits: Sequence[ExitTimes],
    limits: Sequence[tuple[int, str, float, float, float]] = (),
    *,
    ax: Axes | None = None,
) -> SlopeArtists:
    """Draw the local slope d ln τ/d(1/D) against D, with error bars, and its limits as D → 0.

    A slope is the difference between two neighbouring intensities; it is drawn at the middle of their 1/D.

    Parameters
    ----------
    exits : sequence of ExitTimes
    limits : sequence of (label, title, value, lower, upper)
        Activation energies and their bounds (m² s⁻³), drawn over all D.
    ax : matplotlib.axes.Axes, optional
    """
    axes = axes_or_new(ax)
    points, seen = [], list[Any]()
    for one in exits:
        inverse, log_times, errors = one.in_order()
        if len(inverse) < 2:
            continue
        steps = np.diff(inverse)
        slopes = np.diff(log_times) / steps
        spreads = np.hypot(errors[1:], errors[:-1]) / steps
        places = 2.0 / (inverse[1:] + inverse[:-1])
        points.append(axes.errorbar(places, slopes, spreads, color=colour(one.label), label=one.title, **_POINTS))
        seen += [slopes - spreads, slopes + spreads]
    seen += [end for *_, lower, upper in limits for end in (lower, upper)]
    low, high = span(seen)
    lines, bounds = list[Line2D](), list[Rectangle]()
    for label, title, value, lower, upper in limits:
        lines.append(axes.axhline(value, color=colour(label), linestyle="--", linewidth=1.2, label=title))
        ends = lower if np.isfinite(lower) else low, upper if np.isfinite(upper) else high  # or nothing is shaded
        bounds.append(axes.axhspan(*ends, color=colour(label), alpha=0.15, linewidth=0))
    axes.set_xlim(left=0.0)
    axes.set_ylim(low, high)
    axes.set_xlabel(r"noise intensity $D$ (m$^2$ s$^{-3}$)")
    axes.set_ylabel(r"slope $\mathrm{d}\ln\tau\,/\,\mathrm{d}(1/D)$ (m$^2$ s$^{-3}$)")
    powers_of_ten(axes)
    return SlopeArtists(axes, tuple(points), tuple(lines), tuple(bounds), legend_inside(axes, [*points, *lines]))
