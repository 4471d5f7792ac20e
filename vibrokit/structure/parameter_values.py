"""The parameter that a continuation follows, and its values, checked."""

from __future__ import annotations

import math
from collections.abc import Sequence
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import ParameterError, shown
from vibrokit.oscillator import Oscillator
from vibrokit.parts.scene import Entry


def followed_parameter(caller: str, osc: Oscillator, parameter: str) -> Entry:
    """Return a parameter that motion can be followed in; raises ParameterError if it shapes the equations."""
    entry = osc.entry(parameter)
    if entry.declared.structural:
        raise ParameterError(
            f"{caller}: {entry.path} shapes the equations, so motion cannot be followed from value to value; "
            "find the structure at each value."
        )
    return entry


def ordered_values(caller: str, values: Any) -> NDArray[np.float64]:
    """Return values in ascending order; raises ParameterError unless they are finite and distinct."""
    listed = list(values) if isinstance(values, Sequence | np.ndarray) and not isinstance(values, str) else []
    if not listed:
        raise ParameterError(f"{caller}: values must be a sequence of numbers, one or more, got {shown(values)}.")
    for value in listed:
        if isinstance(value, bool) or not isinstance(value, Real) or not math.isfinite(value):
            raise ParameterError(f"{caller}: values must be finite numbers, got {shown(value)}.")
    numbers = np.sort(np.array(listed, dtype=float))
    twice = numbers[:-1][np.diff(numbers) == 0]
    if twice.size:
        raise ParameterError(f"{caller}: values must be distinct, got {twice[0]:g} more than once.")
    return numbers
