"""Pictures of densities: marginals, with samples beside them, and densities on the section."""

from __future__ import annotations

import dataclasses

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from numpy.typing import ArrayLike

from vibrokit.plots.artists import Artists
from vibrokit.plots.axes import DISPLACEMENT, VELOCITY, axes_or_new, colour, phase_plane

_LABELS = {"x": (DISPLACEMENT, r"density of $x$ (m$^{-1}$)"), "v": (VELOCITY, r"density of $v$ (s m$^{-1}$)")}


@dataclasses.dataclass(frozen=True, eq=False)
class MarginalArtists(Artists):
    """A line for each time."""

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
    ax : matplotlib.axes.Axes, optional
    """
    ax = axes_or_new(ax)
    shades = colormaps["viridis"]
    moments, lines = np.asarray(times, dtype=float).tolist(), list[Line2D]()
    for number, (time, density) in enumerate(zip(moments, np.asarray(densities), strict=True)):
        shade = shades(0.9 * number / max(len(moments) - 1, 1))
        lines += ax.plot(places, density, color=shade, label=f"$t$ = {time:.4g} s")
    return MarginalArtists(ax, tuple(lines), _label(ax, axis))


@dataclasses.dataclass(frozen=True, eq=False)
class DensityArtists(Artists):
    """Shades."""

    image: QuadMesh


@dataclasses.dataclass(frozen=True, eq=False)
class SampledArtists(Artists):
    """The density as a `line`, the sample as `dots`."""

    line: Line2D
    dots: Line2D


def sampled_density(
    places: ArrayLike, density: ArrayLike, sample: ArrayLike, *, ax: Axes | None = None
) -> SampledArtists:
    """Draw a density of displacement as a line, and the shares of a sample as dots.

    Parameters
    ----------
    places, density : array_like (n,)
        In m and m⁻¹.
    sample : array_like (count,)
        Displacements (m).
    ax : matplotlib.axes.Axes, optional
    """
    axes = axes_or_new(ax)
    shares, edges = np.histogram(np.asarray(sample, dtype=float), 120, density=True)
    (line,) = axes.plot(places, density, color=colour(0), label="density")
    (dots,) = axes.plot(
        (edges[1:] + edges[:-1]) / 2, shares, ".", color=colour(1), markersize=4, label=f"{np.size(sample)} simulations"
    )
    _label(axes, "x")
    return SampledArtists(axes, line, dots)


def density_map(x: ArrayLike, v: ArrayLike, density: ArrayLike, *, ax: Axes | None = None) -> DensityArtists:
    """Draw a density on the section as shades.

    Parameters
    ----------
    x, v : array_like (nx,), (nv,)
        Nodes (m, m s⁻¹).
    density : array_like (nx, nv)
        In s m⁻².
    ax : matplotlib.axes.Axes, optional
    """
    axes = axes_or_new(ax)
    image = axes.pcolormesh(x, v, np.transpose(density), cmap="magma_r", shading="nearest", rasterized=True)
    axes.figure.colorbar(image, ax=axes, label=r"density $\rho$ (s m$^{-2}$)")
    phase_plane(axes)
    return DensityArtists(axes, image)


def _label(axes: Axes, axis: str) -> Legend:
    """Label the axes of a density of x or of v; return the legend."""
    across, up = _LABELS[axis]
    axes.set(xlabel=across, ylabel=up)
    axes.set_ylim(bottom=0.0)
    return axes.legend(fontsize=8, frameon=False)
