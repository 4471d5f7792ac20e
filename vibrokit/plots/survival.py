"""Picture of the distribution of exit times."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from numpy.typing import ArrayLike

from vibrokit.errors import counted
from vibrokit.plots.artists import Artists
from vibrokit.plots.axes import axes_or_new, colour, legend_inside


@dataclasses.dataclass(frozen=True, eq=False)
class SurvivalArtists(Artists):
    """The share that was seen, in `steps`, and the exponential `law` with the mean that was estimated."""

    steps: Line2D
    law: Line2D


def survival(
    times: ArrayLike, left_over: int, mean: float, *, label: int = 0, ax: Axes | None = None
) -> SurvivalArtists:
    """Draw the share of walkers that have not left against time, and the exponential law, which is a straight line.

    Parameters
    ----------
    times : array_like (count,)
        Exit times (s), in any order.
    left_over : int
        Walkers that had not left by the last of these.
    mean : float
        Mean exit time (s).
    label : int
        Of the attractor that is left: chooses the colour.
    ax : matplotlib.axes.Axes, optional
    """
    axes = axes_or_new(ax)
    known: Any = np.sort(np.asarray(times, dtype=float))
    count = len(known) + left_over
    share = 1.0 - np.arange(len(known) + 1) / count
    if left_over == 0:
        known, share = known[:-1], share[:-1]  # the last share is 0, which a logarithm does not show
    (steps,) = axes.step(
        np.concatenate([[0.0], known]), share, where="post", color=colour(label), label=counted(count, "walker")
    )
    ends = np.array([0.0, known[-1] if len(known) else mean])
    (law,) = axes.plot(ends, np.exp(-ends / mean), "k--", linewidth=1.0, label=f"exponential, mean {mean:.3g} s")
    axes.set_yscale("log")
    axes.set_xlabel("time $t$ (s)")
    axes.set_ylabel("share that has not left")
    legend_inside(axes, [steps, law])
    return SurvivalArtists(axes, steps, law)
