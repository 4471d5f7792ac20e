"""Picture of a measured spectrum and of the one fitted to it."""

from __future__ import annotations

import dataclasses

from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from numpy.typing import ArrayLike

from vibrokit.plots.artists import Artists
from vibrokit.plots.axes import axes_or_new, colour, legend_inside


@dataclasses.dataclass(frozen=True, eq=False)
class SpectrumArtists(Artists):
    """The `measured` density and the `fitted` one."""

    measured: Line2D
    fitted: Line2D


def fitted_spectrum(
    frequencies: ArrayLike, measured: ArrayLike, fitted: ArrayLike, *, name: str = "", ax: Axes | None = None
) -> SpectrumArtists:
    """Draw one-sided densities against the frequency, both on logarithmic scales.

    Parameters
    ----------
    frequencies : array_like (count,)
        In Hz.
    measured, fitted : array_like (count,)
        In (m/s²)²/Hz.
    name : str
        Of the fit, for the legend.
    ax : matplotlib.axes.Axes, optional
    """
    axes = axes_or_new(ax)
    (points,) = axes.plot(frequencies, measured, ".", markersize=3, color=colour(0), label="measured")
    (line,) = axes.plot(frequencies, fitted, "k-", linewidth=1.2, label=name or "fitted")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("frequency (Hz)")
    axes.set_ylabel(r"power spectral density ((m/s$^2$)$^2$/Hz)")
    legend_inside(axes, [points, line])
    return SpectrumArtists(axes, points, line)
