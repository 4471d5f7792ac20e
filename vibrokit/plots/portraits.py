"""Phase portraits."""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from numpy.typing import ArrayLike

from vibrokit.plots.axes import axes_or_new, colour, draw_stops


def phase_portrait(
    x: ArrayLike, v: ArrayLike, *, stops: tuple[float, ...] = (), label: int = 0, ax: Axes | None = None
) -> list[Any]:
    """Draw a trajectory in the phase plane, with the stops.

    Parameters
    ----------
    x, v : array_like (count,)
        Displacement (m) and velocity (m s⁻¹).
    stops : tuple of float
        Places of the stops (m).
    label : int
        Chooses the colour.
    ax : matplotlib Axes, optional

    Returns
    -------
    list of artists
    """
    axes = axes_or_new(ax)
    artists = [*draw_stops(axes, stops), *axes.plot(x, v, color=colour(label), linewidth=1.0)]
    axes.set_xlabel(r"displacement $x$ (m)")
    axes.set_ylabel(r"velocity $v$ (m s$^{-1}$)")
    return artists
