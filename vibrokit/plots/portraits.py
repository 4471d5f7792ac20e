"""Phase portraits."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from numpy.typing import ArrayLike

from vibrokit.plots.artists import Artists, attractor_name
from vibrokit.plots.axes import (
    CROWD,
    DENSE,
    DOTS,
    add_legend,
    axes_or_new,
    colour,
    draw,
    named,
    phase_plane,
    rows,
    span,
)


@dataclasses.dataclass(frozen=True, eq=False)
class PortraitArtists(Artists):
    """The `line` of a trajectory, and the `stops`."""

    line: Line2D
    stops: tuple[Line2D, ...]


@dataclasses.dataclass(frozen=True, eq=False)
class MotionArtists(Artists):
    """Orbit and section points of each motion; the face of each stop and the hatched part behind it."""

    orbits: tuple[Line2D, ...]
    points: tuple[Line2D, ...]
    stops: tuple[Line2D, ...]
    walls: tuple[Rectangle, ...]


def phase_portrait(
    x: ArrayLike, v: ArrayLike, *, stops: tuple[float, ...] = (), label: int = 0, ax: Axes | None = None
) -> PortraitArtists:
    """Draw a trajectory in the phase plane, with the stops.

    Parameters
    ----------
    x, v : array_like (count,)
        Displacement (m) and velocity (m s⁻¹).
    stops : tuple of float
        Places of the stops (m).
    label : int
        Chooses the colour.
    ax : matplotlib.axes.Axes, optional
    """
    axes = axes_or_new(ax)
    dashes = (0, (4, 2))
    faces = tuple(axes.axvline(stop, color="0.55", linewidth=1.0, linestyle=dashes, zorder=0) for stop in stops)
    (line,) = axes.plot(x, v, color=colour(label), linewidth=1.0)
    phase_plane(axes)
    return PortraitArtists(axes, line, faces)


def steady_motions(
    orbits: Sequence[ArrayLike],
    points: Sequence[ArrayLike],
    *,
    stops: Sequence[tuple[float, str]] = (),
    names: Sequence[str] = (),
    ax: Axes | None = None,
) -> MotionArtists:
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
        What the legend calls each motion; ``"attractor 0"`` and so on by default.
    ax : matplotlib.axes.Axes, optional
        A legend is put beside the picture, or inside axes that are given.
    """
    axes = axes_or_new(ax, 7.0, 4.4)
    lines: list[Line2D] = []
    marks: list[Line2D] = []
    paths = [rows(orbit) for orbit in orbits]
    for label, (path, visits) in enumerate(zip(paths, points, strict=True)):
        many, ink, name = len(path) > DENSE, colour(label), attractor_name(label, names)
        look = {"linewidth": 0.3, "alpha": 0.6} if many else {"linewidth": 1.2, "alpha": 1.0}
        lines.append(draw(axes, path, color=ink, label=name, zorder=2, **look))
        edge = DOTS if len(rows(visits)) > CROWD else {"markersize": 6, "markeredgecolor": "white"}
        mark = {"linestyle": "none", "marker": "o", **edge}
        marks.append(draw(axes, visits, color=ink, label="_section", zorder=3, **mark))
    reach = span([*(path[:, 0] for path in paths), [place for place, _ in stops]])
    faces = tuple(axes.axvline(place, color="0.45", linewidth=1.2, zorder=0.6) for place, _ in stops)
    walls = tuple(
        axes.axvspan(
            *((place, max(place, reach[1])) if side == "right" else (min(place, reach[0]), place)),
            facecolor="0.96", edgecolor="0.78", hatch="////", linewidth=0, zorder=0.5,
        )
        for place, side in stops
    )  # fmt: skip
    axes.set_xlim(*reach)
    axes.set_ylim(*span([path[:, 1] for path in paths]))
    phase_plane(axes)
    add_legend(axes, ax, named(lines))
    return MotionArtists(axes, tuple(lines), tuple(marks), faces, walls)
