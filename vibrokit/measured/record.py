"""A measured record: equal steps of time, finite values."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import ParameterError
from vibrokit.measured.real_array import real_array

_JITTER = 1e-3  # of a step: times that are printed with few digits

Array = NDArray[np.float64]


class MeasuredRecord(NamedTuple):
    """Samples at equal steps."""

    values: Array  # (count,)
    step: float  # s


def checked_samples(owner: str, t: Any, values: Any, fewest: int) -> tuple[Array, Array]:
    """Return times and values of a record; raises ParameterError unless they are finite, and enough."""
    try:
        times, samples = (real_array(one) for one in (t, values))
    except (TypeError, ValueError) as error:
        raise ParameterError(f"{owner}: times and values must be sequences of real numbers, got {error}.") from error
    if times.ndim != 1 or times.shape != samples.shape:
        raise ParameterError(
            f"{owner}: times and values must be of one dimension and of the same length, got shapes {times.shape} and "
            f"{samples.shape}."
        )
    if len(times) < fewest:
        raise ParameterError(f"{owner}: a record must have {fewest} samples or more, got {len(times)}.")
    for name, one in (("times", times), ("values", samples)):
        wrong = np.flatnonzero(~np.isfinite(one))
        if wrong.size:
            raise ParameterError(
                f"{owner}: {name} must be finite numbers, got {one[wrong[0]]} at place {wrong[0]}; cut the record "
                "there."
            )
    return times, samples


def checked_record(owner: str, t: Any, values: Any, fewest: int) -> MeasuredRecord:
    """Return a record; raises ParameterError unless it has finite values at equal steps, and enough of them."""
    times, samples = checked_samples(owner, t, values, fewest)
    steps = np.diff(times)
    step = float(steps.mean())
    if not step > 0 or np.abs(steps - step).max() > _JITTER * step:
        raise ParameterError(
            f"{owner}: times must rise by equal steps, got steps from {steps.min():.6g} to {steps.max():.6g} s; "
            "interpolate the record to equal steps first."
        )
    return MeasuredRecord(samples, step)
