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
from numpy.typing import ArrayLike, NDArray

from vibrokit.plots.artists import Artists, attractor_name
from vibrokit.plots.axes import axes_or_new, cell_image, colour, draw, draw_all, named, phase_plane, powers_of_ten

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
    ax : matplotlib.axes.Axes, optional
    """
    axes = axes_or_new(ax, 7.6, 4.8)
    psi = np.ma.masked_invalid(np.asarray(potential, dtype=float))
    box = np.asarray(bounds, dtype=float)
    image = cell_image(axes, psi, box, cmap="YlGnBu_r", vmin=0.0, vmax=top)
    contours = _level_lines(axes, psi, box, top)
    attractor, *more = (
        draw(axes, place, color=colour(own), label=attractor_name(own, names), **_ATTRACTOR)
        for own, place in ((label, points), *others.items())
    )
    crosses, dots = draw_all(axes, saddles, "saddle", **_SADDLE), draw_all(axes, paths, "exit path", **_PATH)
    axes.set_xlim(*box[0])
    axes.set_ylim(*box[1])
    phase_plane(axes)
    words, extend = r"quasi-potential $\Psi$ (m$^2$ s$^{-3}$)", "neither" if top is None else "max"
    bar = axes.figure.colorbar(image, ax=axes, extend=extend, label=words)
    powers_of_ten(bar.ax, "y")
    axes.legend(
        handles=named((attractor, *more, *crosses, *dots)), loc="lower right", bbox_to_anchor=(1.0, 1.0), ncol=4,
        fontsize=8, frameon=False,
    )  # fmt: skip
    return QuasiPotentialArtists(axes, image, contours, attractor, tuple(more), crosses, dots, bar)


def _level_lines(
    axes: Axes, psi: np.ma.MaskedArray[Any, Any], box: NDArray[np.float64], top: float | None
) -> QuadContourSet | None:
    """Draw 12 level lines; none of a potential that is flat or unknown."""
    highest = float(psi.max() if top is None else top) if psi.count() else 0.0
    if highest <= 0 or min(psi.shape) < 2:
        return None
    x, v = (low + (high - low) * (np.arange(n) + 0.5) / n for (low, high), n in zip(box, psi.shape, strict=True))
    return axes.contour(x, v, psi.T, levels=np.linspace(0.0, highest, 14)[1:-1], colors="0.25", linewidths=0.4)
