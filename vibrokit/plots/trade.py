"""Work and precision of steppers."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.lines import Line2D

from vibrokit.plots.artists import Artists
from vibrokit.plots.axes import axes_or_new, colour

_FLOOR = 1e-17  # an error of exactly 0 would have no place on a logarithmic axis


@dataclasses.dataclass(frozen=True, eq=False)
class TradeArtists(Artists):
    """For each stepper: ensembles, `spreads` up to the 90 % quantile, single trajectories; rings around `defaults`."""

    ensembles: tuple[Line2D, ...]
    spreads: tuple[PolyCollection, ...]
    alone: tuple[Line2D, ...]
    defaults: tuple[Line2D, ...]


def work_precision(rows: Sequence[Any], *, ax: Axes | None = None) -> TradeArtists:
    """Draw error against time, one line per stepper: solid in an ensemble, dotted one trajectory at a time.

    Parameters
    ----------
    rows : sequence of TradeRow
        From coarse to fine; any objects with the attributes of `vibrokit.trade.steppers.TradeRow` will do.
    ax : matplotlib.axes.Axes, optional
    """
    axes = axes_or_new(ax, 6.4, 4.8)
    ensembles: list[Line2D] = []
    spreads: list[PolyCollection] = []
    alone: list[Line2D] = []
    defaults: list[Line2D] = []
    for label, name in enumerate(dict.fromkeys(row.name for row in rows)):
        own = [row for row in rows if row.name == name]
        errors = [max(row.error_median, _FLOOR) for row in own]
        times = [1e6 * row.seconds for row in own]
        ensembles += axes.plot(times, errors, "o-", color=colour(label), markersize=4, label=f"{name}, ensemble")
        spreads.append(
            axes.fill_between(
                times, errors, [max(row.error_90, _FLOOR) for row in own], color=colour(label), alpha=0.12, linewidth=0
            )
        )
        alone += axes.plot(
            [1e6 * row.seconds_alone for row in own], errors, "o:", color=colour(label), markersize=3,
            markerfacecolor="white", label=f"{name}, alone",
        )  # fmt: skip
        for row in (row for row in own if row.default):
            defaults += axes.plot(
                1e6 * row.seconds, max(row.error_median, _FLOOR), "o", color=colour(label), markersize=10,
                markerfacecolor="none", label=f"default: {row.stepper}",
            )  # fmt: skip
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel(r"time per trajectory and period (µs)")
    axes.set_ylabel(r"error: distance in $(x, v)$ (m, m s$^{-1}$)")
    axes.grid(which="major", color="0.9", linewidth=0.6)
    axes.legend(fontsize=7, title="line: median, shade: to 90 %", title_fontsize=7)
    return TradeArtists(axes, tuple(ensembles), tuple(spreads), tuple(alone), tuple(defaults))
