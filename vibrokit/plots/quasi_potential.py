"""Picture of a quasi-potential on the section."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike

from vibrokit.plots.axes import axes_or_new, colour, named, phase_plane, rows

_LEVELS = 14
_PATH = "#c4007a"


def quasi_potential_map(
    potential: ArrayLike,
    bounds: ArrayLike,
    points: ArrayLike,
    *,
    label: int = 0,
    top: float | None = None,
    saddles: Sequence[ArrayLike] = (),
    paths: Sequence[ArrayLike] = (),
    ax: Axes | None = None,
) -> list[Any]:
    """Draw the quasi-potential of an attractor as shades and level lines; white where it is not known.

    Parameters
    ----------
    potential : array_like (nx, nv)
        Ψ on the cells (m² s⁻³); infinite or NaN where it is not known.
    bounds : array_like (2, 2)
        Bounds of x and v.
    points : array_like (count, n)
        Points of the attractor, x and v first.
    label : int
        Of the attractor: chooses its colour.
    top : float, optional
        Value from which on all has one shade; by default the largest.
    saddles : sequence of array_like (count, n)
    paths : sequence of array_like (count, n)
        Points of exit paths on the section.
    ax : matplotlib Axes, optional

    Returns
    -------
    list of artists
        The shades, the level lines if there are any, then markers of attractor, saddles and paths.
    """
    axes = axes_or_new(ax, 7.6, 4.8)
    psi = np.ma.masked_invalid(np.asarray(potential, dtype=float))
    box = np.asarray(bounds, dtype=float)
    image = axes.imshow(
        psi.T, origin="lower", extent=tuple(box.ravel()), cmap="YlGnBu_r", vmin=0.0, vmax=top, aspect="auto",
        interpolation="nearest",
    )  # fmt: skip
    artists: list[Any] = [image]
    highest = float(psi.max() if top is None else top) if psi.count() else 0.0
    if highest > 0 and min(psi.shape) > 1:
        x, v = (low + (high - low) * (np.arange(n) + 0.5) / n for (low, high), n in zip(box, psi.shape, strict=True))
        artists.append(
            axes.contour(x, v, psi.T, levels=np.linspace(0.0, highest, _LEVELS)[1:-1], colors="0.25", linewidths=0.4)
        )
    place = rows(points)
    artists += axes.plot(
        place[:, 0], place[:, 1], "o", color=colour(label), markeredgecolor="white", markersize=6, zorder=6,
        label=f"attractor {label}",
    )  # fmt: skip
    for index, visits in enumerate(saddles):
        place = rows(visits)
        artists += axes.plot(
            place[:, 0], place[:, 1], "X", color="black", markeredgecolor="white", markersize=7, zorder=6,
            label="_more" if index else "saddle",
        )  # fmt: skip
    for index, path in enumerate(paths):
        place = rows(path)
        artists += axes.plot(
            place[:, 0], place[:, 1], "o", color=_PATH, markersize=2.4, markeredgewidth=0, zorder=5,
            label="_more" if index else "exit path",
        )  # fmt: skip
    axes.set_xlim(*box[0])
    axes.set_ylim(*box[1])
    phase_plane(axes)
    bar = axes.figure.colorbar(
        image, ax=axes, extend="neither" if top is None else "max", label=r"quasi-potential $\Psi$ (m$^2$ s$^{-3}$)"
    )  # fmt: skip
    bar.ax.ticklabel_format(axis="y", style="sci", scilimits=(-2, 3), useMathText=True)
    axes.legend(
        handles=named(artists), loc="lower left", bbox_to_anchor=(0.0, 1.0), ncol=3, fontsize=8, frameon=False
    )  # fmt: skip
    return artists
