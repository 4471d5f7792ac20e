"""Picture of a quasi-potential on the section."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colorbar import Colorbar
from matplotlib.contour import QuadContourSet
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from numpy.typing import ArrayLike

from vibrokit.plots.artists import Artists, attractor_name
from vibrokit.plots.axes import axes_or_new, colour, draw, named, phase_plane

_LEVELS = 14
_POINTS = {"linestyle": "none", "zorder": 6, "markeredgecolor": "white"}
_ATTRACTOR: dict[str, Any] = {**_POINTS, "marker": "o", "markersize": 6}
_SADDLE: dict[str, Any] = {**_POINTS, "marker": "X", "markersize": 7, "color": "black"}
_PATH: dict[str, Any] = {
    "linestyle": "none", "zorder": 5, "marker": "o", "markersize": 2.4, "markeredgewidth": 0, "color": "#c4007a",
}  # fmt: skip


@dataclasses.dataclass(frozen=True, eq=False)
class QuasiPotentialArtists(Artists):
    """Shades and level lines, which a flat or unknown potential has not; markers of attractors, saddles and `paths`."""

    image: AxesImage
    contours: QuadContourSet | None
    attractor: Line2D
    others: tuple[Line2D, ...]
    saddles: tuple[Line2D, ...]
    paths: tuple[Line2D, ...]
    colorbar: Colorbar


def quasi_potential_map(
    potential: ArrayLike,
    bounds: ArrayLike,
    points: ArrayLike,
    *,
    label: int = 0,
    names: Sequence[str] = (),
    top: float | None = None,
    others: Mapping[int, ArrayLike] = MappingProxyType({}),
    saddles: Sequence[ArrayLike] = (),
    paths: Sequence[ArrayLike] = (),
    ax: Axes | None = None,
) -> QuasiPotentialArtists:
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
    names : sequence of str, optional
        Names of all attractors, in the order of their labels.
    top : float, optional
        Value above which all shades are the same; by default the largest.
    others : mapping from int to array_like (count, n), optional
        Points of other attractors, by label.
    saddles : sequence of array_like (count, n)
    paths : sequence of array_like (count, n)
        Points of exit paths on the section.
    ax : matplotlib Axes, optional

    Returns
    -------
    QuasiPotentialArtists
    """
    axes = axes_or_new(ax, 7.6, 4.8)
    psi = np.ma.masked_invalid(np.asarray(potential, dtype=float))
    box = np.asarray(bounds, dtype=float)
    image = axes.imshow(
        psi.T, origin="lower", extent=tuple(box.ravel()), cmap="YlGnBu_r", vmin=0.0, vmax=top, aspect="auto",
        interpolation="nearest",
    )  # fmt: skip
    contours = None
    highest = float(psi.max() if top is None else top) if psi.count() else 0.0
    if highest > 0 and min(psi.shape) > 1:
        x, v = (low + (high - low) * (np.arange(n) + 0.5) / n for (low, high), n in zip(box, psi.shape, strict=True))
        levels = np.linspace(0.0, highest, _LEVELS)[1:-1]
        contours = axes.contour(x, v, psi.T, levels=levels, colors="0.25", linewidths=0.4)
    attractor, *more = (
        draw(axes, place, color=colour(own), label=attractor_name(own, names), **_ATTRACTOR)
        for own, place in ((label, points), *others.items())
    )
    crosses, dots = (
        tuple(draw(axes, place, label="_more" if k else name, **style) for k, place in enumerate(places))
        for places, name, style in ((saddles, "saddle", _SADDLE), (paths, "exit path", _PATH))
    )
    axes.set_xlim(*box[0])
    axes.set_ylim(*box[1])
    phase_plane(axes)
    bar = axes.figure.colorbar(
        image, ax=axes, extend="neither" if top is None else "max", label=r"quasi-potential $\Psi$ (m$^2$ s$^{-3}$)"
    )  # fmt: skip
    bar.ax.ticklabel_format(axis="y", style="sci", scilimits=(-2, 3), useMathText=True)
    axes.legend(
        handles=named((attractor, *more, *crosses, *dots)), loc="lower right", bbox_to_anchor=(1.0, 1.0), ncol=4,
        fontsize=8, frameon=False,
    )  # fmt: skip
    return QuasiPotentialArtists(axes, image, contours, attractor, tuple(more), crosses, dots, bar)
