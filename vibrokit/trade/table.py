"""Trade: what was measured of the steppers, as rows and as a table."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from vibrokit.text_table import text_table

_HEADINGS = ("stepper", "median", "90 %", "ensemble (µs)", "alone (µs)", "arrays (B)", "")
_ABOVE_FLOOR = 30.0  # an error this far above the smallest of all is not rounding or the reference's own
_ASYMPTOTIC = 0.02  # distances below this are small enough to show an order


@dataclasses.dataclass(frozen=True)
class TradeRow:
    """One setting of one stepper.

    Attributes
    ----------
    name : str
        The stepper.
    stepper : str
        With its setting, as it is typed.
    cost : float
        Steps, or 1/tolerance: grows from coarse to fine.
    error_median, error_90 : float
        Distance in (x, v) to the reference, median and 90% quantile over the starts.
    seconds : float
        Time per trajectory and period, in an ensemble, all threads at work.
    seconds_alone : float
        Time per period of trajectories that are integrated one by one.
    memory : float
        Peak of the arrays that Python held, per trajectory (bytes); a kernel's own few kilobytes are not in it.
    default : bool
        Whether this is what the scene is given by default, for ensembles or for single trajectories.
    """

    name: str
    stepper: str
    cost: float
    error_median: float
    error_90: float
    seconds: float
    seconds_alone: float
    memory: float
    default: bool = False


@dataclasses.dataclass(frozen=True)
class FirstCall:
    """What the first call of a stepper took.

    Attributes
    ----------
    name : str
    seconds : float
    compiled : bool
        Whether it was compiled now; otherwise it came from disk.
    """

    name: str
    seconds: float
    compiled: bool


@dataclasses.dataclass(frozen=True)
class Trade:
    """Work and precision of the steppers on one scene.

    Attributes
    ----------
    rows : tuple of TradeRow
        By stepper, coarse to fine.
    first_calls : tuple of FirstCall
    references : dict of str to str
        What the errors of each stepper are distances to.
    orders : dict of str to float
        Measured exponent of the error: in the step for RK4, in the tolerance for the others; nan where too few
        settings were neither coarse nor at the floor.
    refused : dict of str to str
        Steppers that cannot integrate this scene, with the reason.
    checked : float
        Median distance of the finest stepper to DOP853, an integrator that shares nothing with the steppers but the
        right-hand side.
    starts, periods, threads : int
    """

    rows: tuple[TradeRow, ...]
    first_calls: tuple[FirstCall, ...]
    references: Mapping[str, str]
    orders: Mapping[str, float]
    refused: Mapping[str, str]
    checked: float
    starts: int
    periods: int
    threads: int

    def __str__(self) -> str:
        lines = [
            f"Error: distance in (x, v) from a finer reference after {self.periods} periods, of {self.starts} starts.",
            f"Time per trajectory and period: in an ensemble on {self.threads} threads, and one trajectory alone.",
            "Arrays: peak that Python holds per trajectory (tracemalloc); the kernels' own few kB are not in it.",
            "",
            *text_table([_HEADINGS, *(self._line(row) for row in self.rows)]),
            "",
        ]
        for call in self.first_calls:
            source = "compiled" if call.compiled else "from disk"
            lines.append(
                f"{call.name}: {self._order(call.name)}, against {self.references[call.name]}; "
                f"first call {call.seconds:.1f} s ({source})."
            )
        lines += [f"{name}: not used. {reason}" for name, reason in self.refused.items()]
        lines.append(f"The reference of RK4 and SciPy's DOP853 at its finest differ by {self.checked:.1e} (median).")
        return "\n".join(lines)

    @staticmethod
    def _line(row: TradeRow) -> tuple[str, ...]:
        errors = f"{row.error_median:.2e}", f"{row.error_90:.2e}"
        times = f"{1e6 * row.seconds:.4g}", f"{1e6 * row.seconds_alone:.4g}"
        return (row.stepper, *errors, *times, f"{row.memory:.0f}", "← default" if row.default else "")

    def _order(self, name: str) -> str:
        order = self.orders[name]
        if not np.isfinite(order):
            return "no range of settings shows an order"
        return f"error ∝ step^{order:.1f}" if name == "RK4" else f"error ∝ tolerance^{order:.2f}"


def fitted_order(rows: Sequence[TradeRow], all_rows: Sequence[TradeRow]) -> float:
    """Fit the exponent with which the median error falls as cost rises, between coarse and the floor."""
    floor = _ABOVE_FLOOR * min(row.error_median for row in all_rows)
    errors = np.array([row.error_median for row in rows])
    costs = np.array([row.cost for row in rows])
    kept = (errors > floor) & (errors < _ASYMPTOTIC)
    if kept.sum() < 3:
        return float("nan")
    return float(-np.polyfit(np.log(costs[kept]), np.log(errors[kept]), 1)[0])
