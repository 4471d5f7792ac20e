"""The arrays of a result, from what was measured at each intensity."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray

from vibrokit.analyzers.mfet.estimates import CONFIDENCE
from vibrokit.analyzers.mfet.measurement import AtIntensity
from vibrokit.analyzers.problem import ExitProblem

_RATES = {
    "log_rate": ("log_value", "logarithm of the exit rate (s-1)"),
    "log_rate_error": ("log_error", "standard error of log_rate"),
    "log_rate_lower": ("log_lower", f"lower end of the {CONFIDENCE:.0%} interval of log_rate"),
    "log_rate_upper": ("log_upper", f"upper end of the {CONFIDENCE:.0%} interval of log_rate"),
}


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
    over, along = ("intensity_index",), ("intensity_index", "exit_index")
    variables = {
        name: (
            along, np.array([[getattr(one.rates.get(t), field, np.nan) for t in targets] for one in measured]).reshape(
                len(measured), len(targets)
            ),
            {"long_name": text, "units": "1"},
        )
        for name, (field, text) in _RATES.items()
    } | {
        "rate_target": (("exit_index",), np.array(targets, dtype=np.int64), {"long_name": "label of the target"}),
        "rate_event": ((), problem.exit.event, {"long_name": "what counts as an exit"}),
        "rate_intensity": (
            over, np.array([one.intensity for one in measured]), {"long_name": "noise intensity", "units": "m2 s-3"},
        ),
        "rate_method": (over, np.array([one.method for one in measured]), {"long_name": "how the rate was found"}),
        "exit_time": (
            ("intensity_index", "exit_number"), times, {"long_name": "time of each exit, in order", "units": "s"},
        ),
        "exit_target": (("intensity_index", "exit_number"), goals, {"long_name": "label that each exit leads to"}),
        "walkers_left_over": (
            over, np.array([0 if seen is None else seen.censored for seen in exits]),
            {"long_name": "walkers that had not left"},
        ),
        "time_at_risk": (
            over,
            np.array([
                np.nan if seen is None else seen.at_risk * one.interval
                for one, seen in zip(measured, exits, strict=True)
            ]),
            {"long_name": "time of all walkers together", "units": "s"},
        ),
        "exponential_p_value": (
            over, np.array([one.p_value for one in measured]),
            {"long_name": "probability of a larger deviation from an exponential law", "units": "1"},
        ),
        "step_change": (
            over, np.array([one.step_change for one in measured]),
            {"long_name": "change of log_rate with half the steps", "units": "1"},
        ),
        "step_change_error": (
            over, np.array([one.step_change_error for one in measured]),
            {"long_name": "standard error of step_change", "units": "1"},
        ),
    }  # fmt: skip
    return xarray.Dataset(variables | _escapes(measured))


def _escapes(measured: Sequence[AtIntensity]) -> dict[str, tuple[tuple[str, ...], np.ndarray, dict[str, str]]]:
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
