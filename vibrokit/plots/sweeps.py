"""The picture of a sweep: what each branch of steady states does along a parameter, and how long it lasts."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import ArrayLike, NDArray

from vibrokit.errors import VibrokitError
from vibrokit.plots.artists import Artists
from vibrokit.plots.axes import colour

_PANELS = 4
_LINE: dict[str, Any] = {"marker": "o", "markersize": 2.8, "linewidth": 1.2}
_DASHED = {"color": "0.5", "linestyle": (0, (4, 2)), "linewidth": 0.9, "zorder": 0}


@dataclasses.dataclass(frozen=True, eq=False)
class Branch:
    """What is drawn of one branch, at each value; NaN where it is not known.

    Attributes
    ----------
    number : int
        Chooses the colour.
    name : str
    low, high : array (values,)
        Least and largest displacement (m).
    push : array (values,)
        Largest force of a stop (m s⁻²).
    energy : array (values,)
        Activation energy (m² s⁻³).
    log_time : array (values,)
        ln of the mean exit time in s.
    """

    number: int
    name: str
    low: ArrayLike
    high: ArrayLike
    push: ArrayLike
    energy: ArrayLike
    log_time: ArrayLike


@dataclasses.dataclass(frozen=True, eq=False)
class SweepArtists(Artists):
    """A sweep.

    Attributes
    ----------
    ax : Axes
        The uppermost.
    axes : tuple of Axes
        Displacement, push, activation energy, mean time.
    curves : tuple of Line2D
        Those of the displacement, two for each branch.
    marks : tuple of Line2D
        Bifurcations.
    """

    axes: tuple[Axes, ...]
    curves: tuple[Line2D, ...]
    marks: tuple[Line2D, ...]


def sweep(
    values: ArrayLike,
    branches: Sequence[Branch],
    *,
    stops: Sequence[tuple[str, float]] = (),
    marks: Sequence[tuple[str, float, int]] = (),
    intensity: float = 0.0,
    label: str,
    ax: Any = None,
) -> SweepArtists:
    """Draw four panels over one parameter: displacement with the stops, push of the stops, ΔU with a line at D, ln τ.

    Parameters
    ----------
    values : array_like (values,)
    branches : sequence of Branch
    stops : sequence of (side, position)
        Lines at the positions (m).
    marks : sequence of (kind, value, branch)
        Bifurcations.
    intensity : float
        D (m² s⁻³); 0 for none.
    label : str
        Of the parameter's axis.
    ax : array of 4 Axes, optional

    Returns
    -------
    SweepArtists

    Raises
    ------
    VibrokitError
        `ax` has another number of axes.
    """
    panels = _panels(ax)
    place, curves = np.asarray(values, dtype=float), list[Line2D]()
    for one in branches:
        style = {**_LINE, "color": colour(one.number)}
        curves += panels[0].plot(place, one.high, label=one.name, **style)
        curves += panels[0].plot(place, one.low, label=f"_{one.name}", **style)
        for panel, rows in zip(panels[1:], (one.push, one.energy, one.log_time), strict=True):
            panel.plot(place, rows, **style)
    for _, position in stops:
        panels[0].axhline(position, **_DASHED)
    if intensity > 0:
        panels[2].axhline(intensity, **_DASHED)
        panels[2].annotate("$D$", (1.0, intensity), xycoords=("axes fraction", "data"), fontsize=9, ha="left")
    drawn = [
        line for kind, value, branch in marks
        for line in panels[0].plot(value, 0.02, "^", transform=panels[0].get_xaxis_transform(), color=colour(branch),
                                   markersize=5, label=f"_{kind}", clip_on=False)
    ]  # fmt: skip
    _label(panels, label)
    return SweepArtists(panels[0], tuple(panels), tuple(curves), tuple(drawn))


def _label(panels: NDArray[Any], label: str) -> None:
    titles = (
        "displacement $x$ (m)", r"largest push (m s$^{-2}$)", r"$\Delta U$ (m$^2$ s$^{-3}$)",
        r"mean time $\ln(\tau / 1\,\mathrm{s})$",
    )  # fmt: skip
    for panel, title in zip(panels, titles, strict=True):
        panel.set_ylabel(title, fontsize=9)
        panel.tick_params(labelsize=8)
    if panels[2].lines:
        panels[2].set_yscale("log")
    for panel in panels[:2]:
        panel.ticklabel_format(axis="y", style="sci", scilimits=(-2, 3), useMathText=True)
    panels[-1].set_xlabel(label)
    if panels[0].get_legend_handles_labels()[0]:
        panels[0].legend(fontsize=8, frameon=False, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=4)


def _panels(ax: Any) -> NDArray[Any]:
    if ax is None:
        figure = Figure(figsize=(7.0, 9.0), layout="constrained")
        return figure.subplots(_PANELS, 1, sharex=True)
    given = np.asarray(ax, dtype=object).ravel()
    if given.size != _PANELS:
        raise VibrokitError(f"sweep: ax has {given.size} axes; give {_PANELS}, or None.")
    return given
