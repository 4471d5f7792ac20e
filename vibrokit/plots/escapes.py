"""Picture of realizations on their way out."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, QuadMesh
from matplotlib.lines import Line2D
from numpy.typing import ArrayLike, NDArray

from vibrokit.plots.artists import Artists
from vibrokit.plots.axes import axes_or_new, colour, draw, phase_plane

_CELLS = 120  # along each side, of the density


@dataclasses.dataclass(frozen=True, eq=False)
class EscapeArtists(Artists):
    """Samples in each cell, realizations and where they leave, the `path` that was given, attractors and saddles."""

    density: QuadMesh
    lines: LineCollection
    path: Line2D | None
    ends: Line2D
    attractors: tuple[Line2D, ...]
    saddles: tuple[Line2D, ...]


def escapes(
    paths: NDArray[np.float64],
    *,
    path: ArrayLike | None = None,
    points: Sequence[NDArray[np.float64]] = (),
    saddles: Sequence[NDArray[np.float64]] = (),
    ax: Axes | None = None,
) -> EscapeArtists:
    """Draw the density of samples of realizations, some of the realizations, and a path over them.

    Parameters
    ----------
    paths : array (count, samples, 2)
        x and v of each; NaN before its start.
    path : array_like (samples, 2), optional
        Such as the path of least action.
    points, saddles : sequence of array (count, n)
        Points on the section of each attractor and of each saddle.
    ax : matplotlib.axes.Axes, optional
    """
    axes = axes_or_new(ax)
    samples = paths[np.isfinite(paths).all(axis=2)]
    counts, x, v = np.histogram2d(samples[:, 0], samples[:, 1], bins=_CELLS)
    shown = np.ma.masked_equal(counts.T, 0)
    density = axes.pcolormesh(x, v, np.ma.log10(shown), cmap="Blues", rasterized=True)
    lines = LineCollection(
        [one[np.isfinite(one).all(axis=1)] for one in paths], colors="0.35", linewidths=0.3, alpha=0.35
    )
    axes.add_collection(lines)
    (ends,) = axes.plot(paths[:, -1, 0], paths[:, -1, 1], ".", color="0.2", markersize=4)
    drawn = None if path is None else draw(axes, path, color="crimson", linewidth=1.6)
    dots = {"linestyle": "none", "marker": "o", "markeredgecolor": "white", "markersize": 7}
    known = tuple(draw(axes, own, color=colour(label), **dots) for label, own in enumerate(points))
    crosses = tuple(draw(axes, own, linestyle="none", marker="x", color="black", markersize=6) for own in saddles)
    phase_plane(axes)
    axes.figure.colorbar(density, ax=axes, label="log$_{10}$ of the samples in a cell")
    return EscapeArtists(axes, density, lines, drawn, ends, known, crosses)
