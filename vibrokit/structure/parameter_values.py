"""The parameter that a continuation follows, and its values, checked."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrokit.arguments import members, real
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
    listed = members(values)
    if not listed:
        raise ParameterError(f"{caller}: values must be a sequence of numbers, one or more, got {shown(values)}.")
    for value in listed:
        if not math.isfinite(real(value)):
            raise ParameterError(f"{caller}: values must be finite numbers, got {shown(value)}.")
    numbers = np.sort([real(value) for value in listed])
    twice = numbers[:-1][np.diff(numbers) == 0]
    if twice.size:
        raise ParameterError(f"{caller}: values must be distinct, got {twice[0]:g} more than once.")
    return numbers
