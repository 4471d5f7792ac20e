"""Phase portraits."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from numpy.typing import ArrayLike

from vibrokit.plots.axes import add_legend, axes_or_new, colour, draw_stops, draw_walls, named, phase_plane, rows, span

_SAMPLE = 32  # points above which they are a sample of motion that never repeats, or as crowded as one
_DENSE = 20_000  # samples of a line above which it is drawn thin, as pixels


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
    phase_plane(axes)
    return artists


def steady_motions(
    orbits: Sequence[ArrayLike],
    points: Sequence[ArrayLike],
    *,
    stops: Sequence[tuple[float, str]] = (),
    names: Sequence[str] = (),
    ax: Axes | None = None,
) -> list[Any]:
    """Draw the steady motions of all attractors in the phase plane, with the stops as hatched walls.

    Parameters
    ----------
    orbits : sequence of array_like (samples, 2)
        (x, v) along each motion.
    points : sequence of array_like (count, n)
        Its points on the section, x and v first: marked by dots.
    stops : sequence of (float, str)
        Place of each stop (m) and its side, ``"left"`` or ``"right"``.
    names : sequence of str, optional
        What each motion is called in the legend; ``"attractor 0"`` and so on by default.
    ax : matplotlib Axes, optional
        A legend is put beside the picture, or inside axes that are given.

    Returns
    -------
    list of artists
        Line and markers of each motion, then face and wall of each stop.
    """
    axes = axes_or_new(ax, 7.0, 4.4)
    artists: list[Any] = []
    paths = [rows(orbit) for orbit in orbits]
    for label, (path, visits) in enumerate(zip(paths, points, strict=True)):
        name = names[label] if names else f"attractor {label}"
        many = len(path) > _DENSE
        artists += axes.plot(
            path[:, 0], path[:, 1], color=colour(label), linewidth=0.3 if many else 1.2, alpha=0.6 if many else 1.0,
            label=name, rasterized=many, zorder=2,
        )  # fmt: skip
        place = rows(visits)
        dots = {"markersize": 2.2, "markeredgewidth": 0}
        edge = dots if len(place) > _SAMPLE else {"markersize": 6, "markeredgecolor": "white"}
        artists += axes.plot(
            place[:, 0], place[:, 1], "o", color=colour(label), label="_section", zorder=3, **edge
        )  # fmt: skip
    reach = span([*(path[:, 0] for path in paths), [place for place, _ in stops]])
    artists += draw_walls(axes, stops, reach)
    axes.set_xlim(*reach)
    axes.set_ylim(*span([path[:, 1] for path in paths]))
    phase_plane(axes)
    add_legend(axes, ax, named(artists))
    return artists
