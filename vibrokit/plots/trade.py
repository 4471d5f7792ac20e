"""Work and precision of steppers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

from matplotlib.axes import Axes

from vibrokit.plots.axes import axes_or_new, colour


class WorkPrecision(Protocol):
    """What is drawn of one setting of a stepper."""

    @property
    def name(self) -> str: ...
    @property
    def stepper(self) -> str: ...
    @property
    def error_median(self) -> float: ...
    @property
    def error_90(self) -> float: ...
    @property
    def seconds(self) -> float: ...
    @property
    def seconds_alone(self) -> float: ...
    @property
    def default(self) -> bool: ...


def work_precision(rows: Sequence[WorkPrecision], *, ax: Axes | None = None) -> list[Any]:
    """Draw error against time, one line per stepper: solid in an ensemble, dotted one trajectory at a time.

    Parameters
    ----------
    rows : sequence
        With the attributes of `vibrokit.trade.table.TradeRow`, coarse to fine.
    ax : matplotlib Axes, optional

    Returns
    -------
    list of artists
    """
    axes = axes_or_new(ax)
    artists: list[Any] = []
    for label, name in enumerate(dict.fromkeys(row.name for row in rows)):
        own = [row for row in rows if row.name == name]
        errors = [row.error_median for row in own]
        times = [1e6 * row.seconds for row in own]
        artists += axes.plot(times, errors, "o-", color=colour(label), markersize=4, label=f"{name}, ensemble")
        artists.append(
            axes.fill_between(
                times, errors, [row.error_90 for row in own], color=colour(label), alpha=0.12, linewidth=0
            )
        )
        artists += axes.plot(
            [1e6 * row.seconds_alone for row in own], errors, "o:", color=colour(label), markersize=3,
            markerfacecolor="white", label=f"{name}, alone",
        )  # fmt: skip
        for row in own:
            if row.default:
                artists.append(
                    axes.annotate(
                        f"default: {row.stepper}", (1e6 * row.seconds, row.error_median), fontsize=8,
                        xytext=(6, 6), textcoords="offset points", color=colour(label),
                    )
                )  # fmt: skip
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel(r"time per trajectory and period (µs)")
    axes.set_ylabel(r"distance in $(x, v)$ to the reference (m, m s$^{-1}$)")
    axes.grid(which="major", color="0.9", linewidth=0.6)
    axes.legend(fontsize=8, title="line: median, shade: to 90 %", title_fontsize=8)
    return artists
