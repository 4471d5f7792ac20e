"""What was measured of the stages of least action, as rows and as tables."""

from __future__ import annotations

import dataclasses
import math


@dataclasses.dataclass(frozen=True)
class EnergyRow:
    """One setting of one stage.

    Attributes
    ----------
    setting : str
        As it is typed.
    value : float
        Least action that it finds; NaN where it finds no way out.
    error : float
        Distance of the value from the reference, as a share of the reference.
    told : float
        The error that the stage itself tells, as the same share; NaN where it tells none.
    seconds : float
        Time, all threads at work, nothing compiled in it.
    default : bool
        Whether this is what `LeastAction` does.
    failure : str
        Why there is no value.
    """

    setting: str
    value: float
    error: float
    told: float
    seconds: float
    default: bool
    failure: str = ""


@dataclasses.dataclass(frozen=True)
class EnergyTrade:
    """Work and precision of each stage of `LeastAction`, for the cheapest exit from one attractor.

    Attributes
    ----------
    source, target : int
        Labels of the attractor that is left and of the one that is reached.
    reference : float
        The certified action that all are compared with; NaN where no path was polished.
    reference_from : str
        What it was polished by.
    residual : float
        Of the reference's path.
    plots, graphs, polishes : tuple of EnergyRow
        Of each stage, coarse to fine.
    words : tuple of str
        What there is to be said besides.
    """

    source: int
    target: int
    reference: float
    reference_from: str
    residual: float
    plots: tuple[EnergyRow, ...]
    graphs: tuple[EnergyRow, ...]
    polishes: tuple[EnergyRow, ...]
    words: tuple[str, ...] = ()

    def __str__(self) -> str:
        stages = {"search by shots": self.plots, "search by graph": self.graphs, "polish": self.polishes}
        stages = {title: rows for title, rows in stages.items() if rows}
        width = max(len(row.setting) for rows in stages.values() for row in rows) if stages else 0
        lines = [*self._heading(), *self.words]
        for title, rows in stages.items():
            lines += ["", f"{title:<{width}}  ΔU             error     told      time (s)"]
            lines += [_line(row, width) for row in rows]
        return "\n".join(lines)

    def _heading(self) -> list[str]:
        if not math.isfinite(self.reference):
            return [f"Leaving attractor {self.source}: no path was polished, so errors are not known."]
        return [
            f"Leaving attractor {self.source} for {self.target}. Error: relative distance from {self.reference:.10g}, "
            "the certified path",
            f"by {self.reference_from}, residual {self.residual:.1e}. Told: the error that a setting itself tells.",
        ]


def _line(row: EnergyRow, width: int) -> str:
    mark = "  ← default" if row.default else ""
    if row.failure:
        return f"{row.setting:<{width}}  none. {row.failure}{mark}"
    line = f"{row.setting:<{width}}  {row.value:<13.8g}  {_share(row.error)}  {_share(row.told)}  {row.seconds:<8.3g}"
    return f"{line}{mark}".rstrip()


def _share(number: float) -> str:
    return f"{number:<8.1e}" if math.isfinite(number) else f"{'–':<8}"
