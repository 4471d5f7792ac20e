"""Work and precision of every stepper on one scene: error against computing time on this machine."""

from __future__ import annotations

import dataclasses
import os
import time
import warnings
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import IntegrationError, StepperError
from vibrokit.kernels.choice import CoarseStepsWarning, ensemble_stepper, single_stepper
from vibrokit.kernels.fixed_steps import RK4, RK8, FixedSteps
from vibrokit.kernels.kernel import kernel_for
from vibrokit.kernels.located import FreeFlight, Order8
from vibrokit.kernels.single import record
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.progress import Progress, report, stage, working
from vibrokit.symbolic.flow_kind import Flow
from vibrokit.text_table import text_table
from vibrokit.trade.reference import TIGHTEST, reference_map

STEPS = tuple(2**k for k in range(5, 13))
TOLERANCES = tuple(10.0**-k for k in range(4, 15, 2))
LADDERS: tuple[tuple[Stepper, ...], ...] = (
    tuple(RK4(steps) for steps in STEPS),
    tuple(RK8(steps // 4) for steps in STEPS),
    tuple(Order8(tolerance) for tolerance in TOLERANCES),
    tuple(FreeFlight(tolerance) for tolerance in TOLERANCES),
)
_FINEST = 1e-14

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True)
class TradeRow:
    """One setting of one stepper. Errors are distances in (x, v) to the reference, over the starts."""

    name: str  # the stepper
    stepper: str  # with its setting, as it is typed
    cost: float  # steps, or 1/tolerance: grows from coarse to fine
    error_median: float
    error_90: float  # 90 % quantile
    seconds: float  # per trajectory and period, in an ensemble, all threads at work
    seconds_alone: float  # per period of trajectories that are integrated one by one
    in_steps: bool  # whether `cost` is a number of steps
    default: bool = False  # whether this is what the scene is given, for ensembles or for single trajectories


@dataclasses.dataclass(frozen=True)
class FirstCall:
    """What the first call of a stepper took (s), and whether it was compiled then or came from disk."""

    name: str
    seconds: float
    compiled: bool


@dataclasses.dataclass(frozen=True)
class Trade:
    """Work and precision of the steppers on one scene."""

    rows: tuple[TradeRow, ...]  # by stepper, coarse to fine
    first_calls: tuple[FirstCall, ...]
    references: Mapping[str, str]  # what the errors of each stepper are distances to
    orders: Mapping[str, float]  # exponent of the error, in the step or in the tolerance, or NaN
    unused: Mapping[str, str]  # why a stepper cannot integrate this scene, or a setting is too coarse for it
    checked: float  # median distance of the finest stepper to DOP853, which shares only the right-hand side with it
    starts: int
    periods: int
    threads: int

    def __str__(self) -> str:
        headings = ("stepper", "median", "90 %", "ensemble (µs)", "alone (µs)", "")
        lines = [
            f"Error: distance in (x, v) from a finer reference after {self.periods} periods, of {self.starts} starts.",
            f"Time per trajectory and period: in an ensemble on {self.threads} threads, and one trajectory alone.",
            "",
            *text_table([headings, *(self._line(row) for row in self.rows)]),
            "",
        ]
        for call in self.first_calls:
            source = "compiled" if call.compiled else "from disk"
            lines.append(
                f"{call.name}: {self._order(call.name)}, against {self.references[call.name]}; "
                f"first call {call.seconds:.1f} s ({source})."
            )
        lines += [f"{name}: not used. {reason}" for name, reason in self.unused.items()]
        lines.append(f"The reference of RK4 and SciPy's DOP853 at its finest differ by {self.checked:.1e} (median).")
        return "\n".join(lines)

    @staticmethod
    def _line(row: TradeRow) -> tuple[str, ...]:
        errors = f"{row.error_median:.2e}", f"{row.error_90:.2e}"
        times = f"{1e6 * row.seconds:.4g}", f"{1e6 * row.seconds_alone:.4g}"
        return (row.stepper, *errors, *times, "← default" if row.default else "")

    def _order(self, name: str) -> str:
        order = self.orders[name]
        if not np.isfinite(order):
            return "no range of settings shows an order"
        in_steps = any(row.name == name and row.in_steps for row in self.rows)
        return f"error ∝ step^{order:.1f}" if in_steps else f"error ∝ tolerance^{order:.2f}"


def measure_steppers(
    osc: Oscillator,
    *,
    ladders: tuple[tuple[Stepper, ...], ...] = LADDERS,
    starts: int = 64,
    periods: int = 2,
    seconds: float = 0.6,
    progress: Progress = None,
) -> Trade:
    """Measure error and time of every stepper that can integrate a scene, coarse to fine.

    The error is the distance in (x, v) after a few periods, so that chaos does not amplify it, to a finer reference
    by another method: FreeFlight at 1e-14 for all others, Order8 at 1e-14 for FreeFlight. What these two share, the
    steps in contact, is checked by SciPy's DOP853, restarted at every change of contact. Where FreeFlight cannot
    integrate the scene, DOP853 is the reference of Order8 and RK8, and Order8 that of RK4.

    Each of `ladders` has the settings of one stepper, coarse to fine, each timed for some `seconds`. The `starts` lie
    at random between the stops. NoSectionError is raised if the excitations have no common period, IntegrationError if
    a reference ran out of range.
    """
    states = starts_between_stops(osc, starts, np.random.default_rng(0))
    defaults = {repr(ensemble_stepper(osc, Flow.STATE)), repr(single_stepper(osc, Flow.STATE))}
    rows: list[TradeRow] = []
    with working(progress), stage("steppers", unit="settings"), warnings.catch_warnings():
        warnings.simplefilter("ignore", CoarseStepsWarning)  # too few steps are measured here on purpose
        calls, unused = _first_calls(osc, ladders, states[:1])
        taken = [stepper for ladder in ladders for stepper in ladder if type(stepper).__name__ in calls]
        references = _references(osc, states, periods)
        for done, stepper in enumerate(taken):
            report(1 + done, 1 + len(taken))
            try:
                row = _row(osc, stepper, states, periods, references[type(stepper).__name__][1], seconds)
            except IntegrationError as error:
                unused[repr(stepper)] = str(error)
            else:
                rows.append(dataclasses.replace(row, default=repr(stepper) in defaults))
        report(1 + len(taken))
    checked = reference_map(osc, states[:16], periods, tolerance=TIGHTEST)
    return Trade(
        rows=tuple(rows),
        first_calls=tuple(calls.values()),
        references={name: references[name][0] for name in calls},
        orders={name: _fitted_order([row for row in rows if row.name == name], rows) for name in calls},
        unused=unused,
        checked=float(np.median(np.linalg.norm(references["RK4"][1][:16] - checked, axis=1))),
        starts=starts,
        periods=periods,
        threads=os.cpu_count() or 1,
    )


def _references(osc: Oscillator, states: Array, periods: int) -> dict[str, tuple[str, Array]]:
    """What each stepper is compared with: a finer one of another method, and where it ends."""
    order8 = f"Order8 at {_FINEST:g}", osc.section_map(states, periods, stepper=Order8(_FINEST))
    try:
        flown = f"FreeFlight at {_FINEST:g}", osc.section_map(states, periods, stepper=FreeFlight(_FINEST))
    except StepperError:
        own = f"DOP853 at {TIGHTEST:g}", reference_map(osc, states, periods, tolerance=TIGHTEST)
        return {"RK4": order8, "RK8": own, "Order8": own}
    return {"RK4": flown, "RK8": flown, "Order8": flown, "FreeFlight": order8}


def starts_between_stops(osc: Oscillator, count: int, rng: np.random.Generator) -> Array:
    """Random starts between the stops, with the velocities of free motion over that distance."""
    places = {barrier.side: barrier.position for barrier in osc.barriers}
    reach = max((abs(place) for place in places.values()), default=1.0) or 1.0
    left, right = places.get("left", -reach), places.get("right", reach)
    if left >= right and len(places) < 2:  # a single stop on the far side of 0
        left, right = (left, left + reach) if "left" in places else (right - reach, right)
    speed = reach * osc.reference_frequency
    states = np.column_stack([rng.uniform(left, right, count), rng.uniform(-speed, speed, count)])
    return np.pad(states, ((0, 0), (0, len(osc.noise.extra_states) if osc.noise else 0)))


def _first_calls(
    osc: Oscillator, ladders: tuple[tuple[Stepper, ...], ...], states: Array
) -> tuple[dict[str, FirstCall], dict[str, str]]:
    """Call each stepper once, before anything else does; also return the reasons of those that cannot be used."""
    calls, refused = {}, {}
    for stepper in (ladder[-1] for ladder in ladders):  # the finest, which gives no warning
        name = type(stepper).__name__
        began = time.perf_counter()
        try:
            osc.section_map(states, 1, stepper=stepper)
        except StepperError as error:
            refused[name] = str(error)
        else:
            elapsed = time.perf_counter() - began
            compiled = kernel_for(osc, Flow.STATE, stepper).compilations
            calls[name] = FirstCall(name, elapsed, bool(compiled))
    return calls, refused


def _row(osc: Oscillator, stepper: Stepper, states: Array, periods: int, reference: Array, seconds: float) -> TradeRow:
    errors = np.linalg.norm((osc.section_map(states, periods, stepper=stepper) - reference)[:, :2], axis=1)
    many = _as_many(osc, stepper, states, 0.1 * seconds)
    together = _shortest_time(lambda: osc.section_map(many, 1, stepper=stepper), 0.7 * seconds)
    few, length = states[:8], 8

    def one_by_one() -> None:
        for state in few:
            record(osc, Flow.STATE, stepper, state, 0.0, osc.section_interval, length)

    one_by_one()
    alone = _shortest_time(one_by_one, 0.3 * seconds)
    return TradeRow(
        name=type(stepper).__name__,
        stepper=repr(stepper),
        cost=float(stepper.steps if isinstance(stepper, FixedSteps) else 1 / getattr(stepper, "tolerance", np.nan)),
        in_steps=isinstance(stepper, FixedSteps),
        error_median=float(np.median(errors)),
        error_90=float(np.quantile(errors, 0.9)),
        seconds=together / len(many),
        seconds_alone=alone / (len(few) * length),
    )


def _as_many(osc: Oscillator, stepper: Stepper, states: Array, seconds: float) -> Array:
    """As many trajectories as can be integrated over one period in the time."""
    count = 256
    while True:
        many = np.resize(states, (count, states.shape[1]))
        began = time.perf_counter()
        osc.section_map(many, 1, stepper=stepper)
        if count >= 8192 or time.perf_counter() - began > 0.5 * seconds:
            return many
        count *= 2


def _shortest_time(work: Callable[[], object], seconds: float) -> float:
    """The time of a run that no other program delayed."""
    times: list[float] = []
    while len(times) < 5 or (sum(times) < seconds and len(times) < 100):
        began = time.perf_counter()
        work()
        times.append(time.perf_counter() - began)
    return min(times)


def _fitted_order(rows: Sequence[TradeRow], all_rows: Sequence[TradeRow]) -> float:
    """Fit the exponent with which the median error falls as cost rises; NaN with too few settings above the floor."""
    floor = 30.0 * min(row.error_median for row in all_rows)  # an error above it is not rounding or the reference's
    errors = np.array([row.error_median for row in rows])
    costs = np.array([row.cost for row in rows])
    kept = (errors > floor) & (errors < 0.02)  # distances that are small enough to show an order
    if kept.sum() < 3:
        return float("nan")
    return float(-np.polyfit(np.log(costs[kept]), np.log(errors[kept]), 1)[0])
