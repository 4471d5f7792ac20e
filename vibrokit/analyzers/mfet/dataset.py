"""The arrays of a result, from what was measured at each intensity."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray
from numpy.typing import NDArray

from vibrokit.analyzers.mfet.measurement import CONFIDENCE, AtIntensity
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.analyzers.rate_analyzer import Variable, rate_variables

Array = NDArray[np.float64]


def dataset_of(problem: ExitProblem, measured: Sequence[AtIntensity]) -> xarray.Dataset:
    """Return the arrays of one attractor, as `vibrokit.results.mfet.MFETResult` describes them."""
    targets = sorted({target for one in measured for target in one.rates})
    exits = [one.exits for one in measured]
    longest = max((len(one) for one in exits if one is not None), default=0)
    times, goals = np.full((len(measured), longest), np.nan), np.full((len(measured), longest), -1)
    for number, (one, seen) in enumerate(zip(measured, exits, strict=True)):
        if seen is not None:
            times[number, : len(seen)] = seen.tests * one.interval
            goals[number, : len(seen)] = seen.targets

    def of_rates(field: str) -> Array:
        values = [[getattr(one.rates.get(target), field, np.nan) for target in targets] for one in measured]
        return np.array(values).reshape(len(measured), len(targets))

    def of_each(values: list[Any], text: str, units: str = "") -> Variable:
        return ("intensity_index",), np.array(values), {"long_name": text} | ({"units": units} if units else {})

    at_risk = [
        np.nan if seen is None else seen.at_risk * one.interval for one, seen in zip(measured, exits, strict=True)
    ]
    left_over = [0 if seen is None else seen.censored for seen in exits]
    of = ("intensity_index", "exit_number")
    rates = rate_variables(
        problem,
        [one.intensity for one in measured],
        [one.method for one in measured],
        targets,
        {
            "log_rate": (of_rates("log_value"), "logarithm of the exit rate (s-1)"),
            "log_rate_error": (of_rates("log_error"), "standard error of log_rate"),
            "log_rate_lower": (of_rates("log_lower"), f"lower end of the {CONFIDENCE:.0%} interval of log_rate"),
            "log_rate_upper": (of_rates("log_upper"), f"upper end of the {CONFIDENCE:.0%} interval of log_rate"),
        },
    )
    others = {
        "exit_time": (of, times, {"long_name": "time of each exit, in order", "units": "s"}),
        "exit_target": (of, goals, {"long_name": "label that each exit leads to"}),
        "walkers_left_over": of_each(left_over, "walkers that had not left"),
        "time_at_risk": of_each(at_risk, "time of all walkers together", "s"),
        "exponential_p_value": of_each(
            [one.p_value for one in measured], "probability of a larger deviation from an exponential law", "1"
        ),
        "step_change": of_each([one.step_change for one in measured], "change of log_rate with half the steps", "1"),
        "step_change_error": of_each([one.step_change_error for one in measured], "standard error of step_change", "1"),
    }
    return xarray.Dataset(rates | others | _escapes(measured))


def _escapes(measured: Sequence[AtIntensity]) -> dict[str, Variable]:
    """The last parts of realizations; empty if none was kept."""
    known = [one.escapes for one in measured]
    if all(one is None for one in known):
        return {}
    count = max(len(one.paths) for one in known if one is not None)
    samples = max(len(one.times) for one in known if one is not None)
    paths = np.full((len(measured), count, samples, 2), np.nan)
    times, targets = np.full((len(measured), samples), np.nan), np.full((len(measured), count), -1)
    for number, one in enumerate(known):
        if one is not None:
            paths[number, : len(one.paths), samples - len(one.times) :] = one.paths
            times[number, samples - len(one.times) :] = one.times
            targets[number, : len(one.targets)] = one.targets
    dims = ("intensity_index", "escape", "escape_sample")
    return {
        "escape_x": (dims, paths[..., 0], {"long_name": "displacement on the way out", "units": "m"}),
        "escape_v": (dims, paths[..., 1], {"long_name": "velocity on the way out", "units": "m s-1"}),
        "escape_time": (
            ("intensity_index", "escape_sample"), times, {"long_name": "time since the exit", "units": "s"},
        ),
        "escape_target": (dims[:2], targets, {"long_name": "label that it leads to"}),
    }  # fmt: skip
