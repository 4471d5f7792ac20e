"""Basins of attraction on the section."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap, to_rgb
from numpy.typing import ArrayLike, NDArray

from vibrokit.plots.axes import axes_or_new, colour


def basin_map(
    labels: NDArray[Any], bounds: ArrayLike, points: Sequence[ArrayLike], *, ax: Axes | None = None
) -> list[Any]:
    """Draw basins as pale colours and attractors as dots; cells that settled nowhere are grey.

    Parameters
    ----------
    labels : int array (nx, nv)
    bounds : array_like (2, 2)
        Bounds of x and v.
    points : sequence of array_like (period, n)
        Points of each attractor.
    ax : matplotlib Axes, optional

    Returns
    -------
    list of artists
    """
    axes = axes_or_new(ax, 5.4, 4.6)
    (x_low, x_high), (v_low, v_high) = np.asarray(bounds)
    pale = [(0.82, 0.82, 0.82), *(tuple(0.35 * np.array(to_rgb(colour(k))) + 0.65) for k in range(len(points)))]
    image = axes.imshow(
        labels.T,
        origin="lower",
        extent=(x_low, x_high, v_low, v_high),
        cmap=ListedColormap(pale),
        vmin=-1.5,
        vmax=len(points) - 0.5,
        aspect="auto",
        interpolation="nearest",
    )
    artists: list[Any] = [image]
    for label, visits in enumerate(points):
        place = np.asarray(visits)
        artists += axes.plot(
            place[:, 0], place[:, 1], "o", color=colour(label), markeredgecolor="white", label=f"attractor {label}"
        )
    axes.set_xlabel(r"displacement $x$ (m)")
    axes.set_ylabel(r"velocity $v$ (m s$^{-1}$)")
    return artists
