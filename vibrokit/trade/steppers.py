"""Work and precision of every stepper on one scene: what a digit costs on this machine."""

from __future__ import annotations

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
from vibrokit.kernels.ensemble import Progress
from vibrokit.kernels.free_flight import FreeFlight
from vibrokit.kernels.kernel import kernel_for
from vibrokit.kernels.order8 import Order8
from vibrokit.kernels.rk4 import RK4
from vibrokit.kernels.single import record
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.symbolic.flow_kind import Flow
from vibrokit.trade.reference import reference_map
from vibrokit.trade.table import FirstCall, Trade, TradeRow, fitted_order

STEPS = tuple(2**k for k in range(5, 13))
TOLERANCES = tuple(10.0**-k for k in range(4, 15, 2))
LADDERS: tuple[tuple[Stepper, ...], ...] = (
    tuple(RK4(steps) for steps in STEPS),
    tuple(Order8(tolerance) for tolerance in TOLERANCES),
    tuple(FreeFlight(tolerance) for tolerance in TOLERANCES),
)
_BLOCK = 64  # trajectories that one thread is given at least
_MOST = 8192
_LEAST_REPEATS = 5
_ALONE = 8  # trajectories that are timed one by one

Array = NDArray[np.float64]


def measure_steppers(
    osc: Oscillator,
    *,
    ladders: tuple[tuple[Stepper, ...], ...] = LADDERS,
    starts: int = 48,
    periods: int = 2,
    seconds: float = 0.6,
    rng: int | np.random.Generator = 0,
    progress: Progress | None = None,
) -> Trade:
    """Measure error, time and memory of every stepper that can integrate a scene, coarse to fine.

    The error is the distance in (x, v) after a few periods, so that chaos does not amplify it, to an independent
    reference: SciPy's DOP853 at relative tolerance 1e-13, restarted at every change of contact.

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
    progress : callable, optional
        Called with (settings done, settings in all); the reference counts as one.

    Returns
    -------
    Trade

    Raises
    ------
    NoSectionError
        The excitations have no common period.
    """
    states = starts_between_stops(osc, starts, np.random.default_rng(rng))
    total = 1 + sum(len(ladder) for ladder in ladders)
    defaults = {repr(ensemble_stepper(osc, Flow.STATE)), repr(single_stepper(osc, Flow.STATE))}
    reference = reference_map(osc, states, periods)
    done = 1
    rows, calls, refused = [], [], {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CoarseStepsWarning)  # too few steps are what is measured here
        for ladder in ladders:
            try:
                calls.append(_first_call(osc, ladder[0], states, periods))
            except StepperError as error:
                refused[type(ladder[0]).__name__] = str(error)
                done += len(ladder)
                continue
            for stepper in ladder:
                if progress is not None:
                    progress(done, total)
                rows.append(_row(osc, stepper, states, periods, reference, seconds, repr(stepper) in defaults))
                done += 1
    if progress is not None:
        progress(total, total)
    orders = {call.name: fitted_order([row for row in rows if row.name == call.name], rows) for call in calls}
    return Trade(tuple(rows), tuple(calls), orders, refused, starts, periods, os.cpu_count() or 1)


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


def _first_call(osc: Oscillator, stepper: Stepper, states: Array, periods: int) -> FirstCall:
    began = time.perf_counter()
    osc.section_map(states, periods, stepper=stepper)
    elapsed = time.perf_counter() - began
    compiled = kernel_for(osc, Flow.STATE, stepper).module.advance.stats.cache_misses
    return FirstCall(type(stepper).__name__, elapsed, bool(compiled))


def _row(
    osc: Oscillator, stepper: Stepper, states: Array, periods: int, reference: Array, seconds: float, default: bool
) -> TradeRow:
    began = time.perf_counter()
    ended = osc.section_map(states, periods, stepper=stepper)
    rough = (time.perf_counter() - began) / len(states)
    errors = np.linalg.norm(ended - reference, axis=1)
    many = _ensemble_size(seconds, rough)
    crowd = np.resize(states, (many, states.shape[1]))
    together = _median_time(lambda: osc.section_map(crowd, periods, stepper=stepper), 0.7 * seconds)
    interval, length = osc.section_interval, max(periods, 8)
    few = states[:_ALONE]

    def one_by_one() -> None:
        for state in few:
            record(osc, Flow.STATE, stepper, state, 0.0, interval, length)

    one_by_one()
    alone = _median_time(one_by_one, 0.3 * seconds)
    return TradeRow(
        name=type(stepper).__name__,
        stepper=repr(stepper),
        cost=float(stepper.steps if isinstance(stepper, RK4) else 1 / getattr(stepper, "tolerance", np.nan)),
        error_median=float(np.median(errors)),
        error_90=float(np.quantile(errors, 0.9)),
        seconds=together / (many * periods),
        seconds_alone=alone / (len(few) * length),
        memory=_peak_of_arrays(lambda: osc.section_map(crowd, periods, stepper=stepper)) / many,
        default=default,
    )


def _ensemble_size(seconds: float, rough: float) -> int:
    """As many trajectories as fit in the time a few times over, at least one block for each thread."""
    least = _BLOCK * (os.cpu_count() or 1)
    fitting = seconds / (2 * _LEAST_REPEATS * max(rough, 1e-9))
    return int(min(_MOST, max(least, _BLOCK * (fitting // _BLOCK))))


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
