"""Where pictures are drawn."""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

COLOURS = ("#3b6ea8", "#c8553d", "#588b5b", "#8e6bb0", "#c9a227", "#5f6b73", "#a8487a", "#4aa3a2")


def axes_or_new(ax: Axes | None, width: float = 6.0, height: float = 4.2) -> Axes:
    """Return `ax`, or the axes of a new figure that belongs to no window."""
    if ax is not None:
        return ax
    figure = Figure(figsize=(width, height), layout="constrained")
    return figure.add_subplot()


def colour(label: int) -> str:
    """Return the colour of an attractor, the same in all pictures."""
    return COLOURS[label % len(COLOURS)]


def draw_stops(ax: Axes, stops: Any) -> list[Any]:
    """Draw the stops as vertical lines."""
    return [ax.axvline(place, color="0.55", linewidth=1.0, linestyle=(0, (4, 2)), zorder=0) for place in stops]
