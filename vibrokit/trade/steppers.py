"""Work and precision of every stepper on one scene: error against computing time on this machine."""

from __future__ import annotations

import dataclasses
import os
import statistics
import time
import tracemalloc
import warnings
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import StepperError
from vibrokit.kernels.choice import CoarseStepsWarning, ensemble_stepper, single_stepper
from vibrokit.kernels.free_flight import FreeFlight
from vibrokit.kernels.kernel import kernel_for
from vibrokit.kernels.order8 import Order8
from vibrokit.kernels.rk4 import RK4
from vibrokit.kernels.single import record
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.progress import Progress, report, stage, working
from vibrokit.symbolic.flow_kind import Flow
from vibrokit.trade.reference import TIGHTEST, reference_map
from vibrokit.trade.table import FirstCall, Trade, TradeRow, fitted_order

STEPS = tuple(2**k for k in range(5, 13))
TOLERANCES = tuple(10.0**-k for k in range(4, 15, 2))
LADDERS: tuple[tuple[Stepper, ...], ...] = (
    tuple(RK4(steps) for steps in STEPS),
    tuple(Order8(tolerance) for tolerance in TOLERANCES),
    tuple(FreeFlight(tolerance) for tolerance in TOLERANCES),
)
_FINEST = 1e-14
_CHECKED = 16  # starts on which the references themselves are checked
_MOST = 8192
_FEW = 256
_MEASURED = 1024  # trajectories whose arrays are measured
_LEAST_REPEATS = 5
_ALONE = 8  # trajectories that are timed one by one

Array = NDArray[np.float64]


def measure_steppers(
    osc: Oscillator,
    *,
    ladders: tuple[tuple[Stepper, ...], ...] = LADDERS,
    starts: int = 64,
    periods: int = 2,
    seconds: float = 0.6,
    rng: int | np.random.Generator = 0,
    progress: Progress = None,
) -> Trade:
    """Measure error, time and memory of every stepper that can integrate a scene, coarse to fine.

    The error is the distance in (x, v) after a few periods, so that chaos does not amplify it, to a finer reference
    by another method: FreeFlight at 1e-14 for RK4 and Order8, Order8 at 1e-14 for FreeFlight. What these two share, the
    steps in contact, is checked by SciPy's DOP853, restarted at every change of contact. Where FreeFlight cannot
    integrate the scene, DOP853 is the reference of Order8.

    Parameters
    ----------
    osc : Oscillator
    ladders : tuple of tuples of Stepper
        The settings of each stepper, coarse to fine.
    starts : int
        Random starts between the stops.
    periods : int
        Sections from start to end.
    seconds : float
        Time that each setting is timed for.
    rng : int or numpy.random.Generator
        Chooses the starts.
    progress : bool or callable, optional

    Returns
    -------
    Trade

    Raises
    ------
    NoSectionError
        The excitations have no common period.
    IntegrationError
        A reference ran out of range.
    """
    states = starts_between_stops(osc, starts, np.random.default_rng(rng))
    defaults = {repr(ensemble_stepper(osc, Flow.STATE)), repr(single_stepper(osc, Flow.STATE))}
    rows: list[TradeRow] = []
    with working(progress), stage("steppers", unit="settings"), warnings.catch_warnings():
        warnings.simplefilter("ignore", CoarseStepsWarning)  # too few steps are measured here on purpose
        calls, refused = _first_calls(osc, ladders, states[:1])
        taken = [stepper for ladder in ladders for stepper in ladder if type(stepper).__name__ in calls]
        references = References(osc, states, periods)
        for done, stepper in enumerate(taken):
            report(1 + done, 1 + len(taken))
            row = _row(osc, stepper, states, periods, references.ends_for(type(stepper).__name__), seconds)
            rows.append(dataclasses.replace(row, default=repr(stepper) in defaults))
        report(1 + len(taken))
    return Trade(
        rows=tuple(rows),
        first_calls=tuple(calls.values()),
        references={name: references.title_for(name) for name in calls},
        orders={name: fitted_order([row for row in rows if row.name == name], rows) for name in calls},
        refused=refused,
        checked=references.check(_CHECKED),
        starts=starts,
        periods=periods,
        threads=os.cpu_count() or 1,
    )


class References:
    """Where the starts end, by the finest steppers, each found by another method than what it is compared with.

    Parameters
    ----------
    osc : Oscillator
    states : array (count, n)
    periods : int
    """

    def __init__(self, osc: Oscillator, states: Array, periods: int) -> None:
        self.osc, self.states, self.periods = osc, states, periods
        order8 = osc.section_map(states, periods, stepper=Order8(_FINEST))
        self.ends = {"Order8": order8}
        try:
            self.ends["FreeFlight"] = osc.section_map(states, periods, stepper=FreeFlight(_FINEST))
        except StepperError:
            self.ends["DOP853"] = reference_map(osc, states, periods, tolerance=TIGHTEST)

    def _source(self, name: str) -> str:
        flown = "FreeFlight" in self.ends
        if name == "Order8":
            return "FreeFlight" if flown else "DOP853"
        return "FreeFlight" if flown and name != "FreeFlight" else "Order8"

    def title_for(self, name: str) -> str:
        """What a stepper is compared with."""
        source = self._source(name)
        return f"{source} at {TIGHTEST if source == 'DOP853' else _FINEST:g}"

    def ends_for(self, name: str) -> Array:
        """Ends that a stepper is compared with."""
        return self.ends[self._source(name)]

    def check(self, count: int) -> float:
        """Median distance of the finest steppers to DOP853."""
        own = reference_map(self.osc, self.states[:count], self.periods, tolerance=TIGHTEST)
        return float(np.median(np.linalg.norm(self.ends_for("RK4")[:count] - own, axis=1)))


def starts_between_stops(osc: Oscillator, count: int, rng: np.random.Generator) -> Array:
    """Random starts between the stops, with the velocities of free motion over that distance."""
    places = {barrier.side: barrier.position for barrier in osc.barriers}
    reach = max((abs(place) for place in places.values()), default=1.0) or 1.0
    left, right = places.get("left", -reach), places.get("right", reach)
    if left >= right and len(places) < 2:  # a single stop on the far side of 0
        left, right = (left, left + reach) if "left" in places else (right - reach, right)
    speed = reach * osc.natural_frequency
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
            compiled = kernel_for(osc, Flow.STATE, stepper).module.advance.stats.cache_misses
            calls[name] = FirstCall(name, elapsed, bool(compiled))
    return calls, refused


def _row(osc: Oscillator, stepper: Stepper, states: Array, periods: int, reference: Array, seconds: float) -> TradeRow:
    errors = np.linalg.norm((osc.section_map(states, periods, stepper=stepper) - reference)[:, :2], axis=1)
    many = _as_many(osc, stepper, states, seconds / (2 * _LEAST_REPEATS))
    together = _median_time(lambda: osc.section_map(many, 1, stepper=stepper), 0.7 * seconds)
    few, length = states[:_ALONE], 8

    def one_by_one() -> None:
        for state in few:
            record(osc, Flow.STATE, stepper, state, 0.0, osc.section_interval, length)

    one_by_one()
    alone = _median_time(one_by_one, 0.3 * seconds)
    counted = np.resize(states, (_MEASURED, states.shape[1]))
    return TradeRow(
        name=type(stepper).__name__,
        stepper=repr(stepper),
        cost=float(stepper.steps if isinstance(stepper, RK4) else 1 / getattr(stepper, "tolerance", np.nan)),
        error_median=float(np.median(errors)),
        error_90=float(np.quantile(errors, 0.9)),
        seconds=together / len(many),
        seconds_alone=alone / (len(few) * length),
        memory=_peak_of_arrays(lambda: osc.section_map(counted, 1, stepper=stepper)) / _MEASURED,
    )


def _as_many(osc: Oscillator, stepper: Stepper, states: Array, seconds: float) -> Array:
    """As many trajectories as can be integrated over one period in the time."""
    count = _FEW
    while True:
        many = np.resize(states, (count, states.shape[1]))
        began = time.perf_counter()
        osc.section_map(many, 1, stepper=stepper)
        if count >= _MOST or time.perf_counter() - began > 0.5 * seconds:
            return many
        count *= 2


def _median_time(work: Callable[[], object], seconds: float) -> float:
    times: list[float] = []
    while len(times) < _LEAST_REPEATS or (sum(times) < seconds and len(times) < 100):
        began = time.perf_counter()
        work()
        times.append(time.perf_counter() - began)
    return statistics.median(times)


def _peak_of_arrays(work: Callable[[], object]) -> float:
    tracemalloc.start()
    try:
        work()
        return float(tracemalloc.get_traced_memory()[1])
    finally:
        tracemalloc.stop()
