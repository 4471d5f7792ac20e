"""The picture of a sweep: what each branch of steady states does along a parameter, and how long it lasts."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import ArrayLike, NDArray

from vibrokit.plots.artists import Artists
from vibrokit.plots.axes import colour, named, panels_or_new, powers_of_ten, span
from vibrokit.text_units import length_unit

_PANELS: Mapping[str, str] = {
    "low": "displacement x ({length})",
    "push": "largest push (m s⁻²)",
    "energy": "ΔU (m² s⁻³)",
    "log_time": "mean time, ln(τ / 1 s)",
}
_LINE: dict[str, Any] = {"marker": "o", "markersize": 2.8, "linewidth": 1.2}
_DASHED: dict[str, Any] = {"color": "0.5", "linestyle": (0, (4, 2)), "linewidth": 0.9, "zorder": 0}


@dataclasses.dataclass(frozen=True, eq=False)
class Branch:
    """What is drawn of one branch, at each value; NaN where it is not known."""

    number: int  # chooses the colour
    name: str
    low: ArrayLike  # displacement (m)
    high: ArrayLike
    push: ArrayLike  # of the stops (m s⁻²)
    energy: ArrayLike  # m² s⁻³
    log_time: ArrayLike  # ln of s


@dataclasses.dataclass(frozen=True, eq=False)
class SweepArtists(Artists):
    """A sweep.

    Attributes
    ----------
    ax : Axes
        The uppermost.
    axes : tuple of Axes
        One for each panel.
    curves : tuple of Line2D
        Those of the displacement, two for each branch.
    marks : tuple of Line2D
        Bifurcations.
    lost : tuple of Line2D
        Ends of exit paths that were lost.
    """

    axes: tuple[Axes, ...]
    curves: tuple[Line2D, ...]
    marks: tuple[Line2D, ...]
    lost: tuple[Line2D, ...]


def sweep(
    values: ArrayLike,
    branches: Sequence[Branch],
    *,
    stops: Sequence[ArrayLike] = (),
    marks: Sequence[tuple[str, float, int]] = (),
    changes: Sequence[tuple[float, int, str]] = (),
    lost: Sequence[tuple[float, float, int]] = (),
    intensity: ArrayLike = 0.0,
    searched: ArrayLike = (),
    label: str,
    length: tuple[str, float] | None = None,
    ax: Any = None,
) -> SweepArtists:
    """Draw panels over one parameter: displacement with the stops, push of the stops, ΔU with a line at D, ln τ.

    A panel for which nothing is known is left out.

    Parameters
    ----------
    values : array_like (values,)
    branches : sequence of Branch
    stops : sequence of array_like (values,)
        Position of each stop (m).
    marks : sequence of (kind, value, branch)
        Bifurcations.
    changes : sequence of (value, branch, text)
        Where a branch begins or ceases to touch a stop: a dotted line, with the text in the legend.
    lost : sequence of (value, action, branch)
        Where exit paths were lost (m² s⁻³).
    intensity : float or array_like (values,)
        D (m² s⁻³); 0 for none.
    searched : array_like
        Values at which exit paths were searched for, whose energies have full markers.
    label : str
        Of the parameter's axis.
    length : tuple of (str, float), optional
        Unit of displacements and its size (m); by default one in which they are read easily.
    ax : array of Axes, optional
        One for each panel.

    Raises
    ------
    ArgumentError
        `ax` has another number of axes.
    """
    shown = [
        name for name in _PANELS if name == "low" or any(np.isfinite(getattr(one, name)).any() for one in branches)
    ]
    grid = panels_or_new(ax, (len(shown), 1), (8.4, 0.8 + 2.2 * len(shown)))
    panels: dict[str, Axes] = dict(zip(shown, grid[:, 0], strict=True))
    place, curves, first = np.asarray(values, dtype=float), list[Line2D](), panels["low"]
    name, size = length or length_unit(span([one.high for one in branches] + [one.low for one in branches])[1])
    metre = 1.0 / size
    for one in branches:
        curves += _draw_branch(panels, place, one, metre, np.isin(place, searched))
    for number, position in enumerate(stops):
        first.plot(place, metre * np.asarray(position), label="_stop" if number else "stops", **_DASHED)
    strength = np.broadcast_to(np.asarray(intensity, dtype=float), place.shape)
    if "energy" in panels and (strength > 0).any():
        panels["energy"].plot(place, np.where(strength > 0, strength, np.nan), label="_D", **_DASHED)
        beside: dict[str, Any] = {"xycoords": ("axes fraction", "data"), "va": "center", "fontsize": 9}
        panels["energy"].annotate("D", (1.01, strength[-1]), **beside)
    drawn, ends = list[Line2D](), list[Line2D]()
    at_foot: dict[str, Any] = {"transform": first.get_xaxis_transform(), "markersize": 5, "clip_on": False}
    for kind, value, branch in marks:
        drawn += first.plot(value, 0.02, "^", color=colour(branch), label=f"_{kind}", **at_foot)
    for value, branch, text in changes:
        first.axvline(value, color=colour(branch), linestyle=":", linewidth=1.0, label=text, zorder=0)
    cross: dict[str, Any] = {"markersize": 8, "markeredgewidth": 1.6, "label": "_lost"}
    for value, action, branch in lost if "energy" in panels else ():
        ends += panels["energy"].plot(value, action, "x", color=colour(branch), **cross)
    _label(panels, label, name)
    _explain(first, ax, drawn, ends)
    return SweepArtists(first, tuple(panels.values()), tuple(curves), tuple(drawn), tuple(ends))


def _draw_branch(
    panels: Mapping[str, Axes], place: NDArray[np.float64], one: Branch, metre: float, searched: NDArray[np.bool_]
) -> list[Line2D]:
    """Draw one branch into all panels, with full markers where paths were searched; return its displacements."""
    style: dict[str, Any] = {**_LINE, "color": colour(one.number)}
    for name in panels.keys() - {"low"}:
        hollow = {"markerfacecolor": "white"} if name == "energy" else {}
        panels[name].plot(place, getattr(one, name), label=f"_{one.name}", **style | hollow)
    if "energy" in panels:
        panels["energy"].plot(place[searched], np.asarray(one.energy)[searched], **style | {"linestyle": ""})
    upper = panels["low"].plot(place, metre * np.asarray(one.high), label=one.name, **style)
    return upper + panels["low"].plot(place, metre * np.asarray(one.low), label=f"_{one.name}", **style)


def _explain(first: Axes, given: Any, bifurcations: Sequence[Line2D], ends: Sequence[Line2D]) -> None:
    """Add the legend beside all panels, or inside axes that were given, with signs of bifurcations and lost paths."""
    signs = [
        Line2D([], [], color="0.3", linestyle="", marker=mark, markersize=size, label=label)
        for drawn, mark, size, label in ((bifurcations, "^", 5, "bifurcation"), (ends, "x", 8, "path lost"))
        if drawn
    ]
    handles = [*named(first.lines), *signs]
    if given is not None:
        first.legend(handles=handles, fontsize=7, framealpha=0.85, loc="best")
    elif isinstance(first.figure, Figure):
        first.figure.legend(handles=handles, fontsize=8, frameon=False, loc="outside right upper")


def _label(panels: Mapping[str, Axes], label: str, length: str) -> None:
    for name, panel in panels.items():
        panel.set_ylabel(_PANELS[name].format(length=length), fontsize=9)
        panel.tick_params(which="both", labelsize=8)
        if name == "energy":
            panel.set_yscale("log")
        else:
            powers_of_ten(panel, "y")
    list(panels.values())[-1].set_xlabel(label)
