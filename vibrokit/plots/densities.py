"""Pictures of densities: marginals at some times."""

from __future__ import annotations

import dataclasses

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from numpy.typing import ArrayLike

from vibrokit.plots.artists import Artists
from vibrokit.plots.axes import axes_or_new

_LABELS = {
    "x": (r"displacement $x$ (m)", r"density of $x$ (m$^{-1}$)"),
    "v": (r"velocity $v$ (m s$^{-1}$)", r"density of $v$ (s m$^{-1}$)"),
}


@dataclasses.dataclass(frozen=True, eq=False)
class MarginalArtists(Artists):
    """Marginal densities.

    Attributes
    ----------
    ax : Axes
    lines : tuple of Line2D
        One for each time.
    legend : Legend
    """

    lines: tuple[Line2D, ...]
    legend: Legend


def marginal_lines(
    places: ArrayLike, densities: ArrayLike, times: ArrayLike, *, axis: str = "x", ax: Axes | None = None
) -> MarginalArtists:
    """Draw marginal densities, a line for each time.

    Parameters
    ----------
    places : array_like (n,)
    densities : array_like (count, n)
    times : array_like (count,)
        In s.
    axis : str
        ``"x"`` or ``"v"``.
    ax : matplotlib Axes, optional
    """
    ax = axes_or_new(ax)
    shades = colormaps["viridis"]
    moments, lines = np.asarray(times, dtype=float).tolist(), list[Line2D]()
    for number, (time, density) in enumerate(zip(moments, np.asarray(densities), strict=True)):
        shade = shades(0.9 * number / max(len(moments) - 1, 1))
        lines += ax.plot(places, density, color=shade, label=f"$t$ = {time:.4g} s")
    ax.set_xlabel(_LABELS[axis][0])
    ax.set_ylabel(_LABELS[axis][1])
    ax.set_ylim(bottom=0.0)
    return MarginalArtists(ax, tuple(lines), ax.legend(fontsize=8, frameon=False))
