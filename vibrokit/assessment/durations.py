"""Durations as text: ``"8 h"`` in seconds, and seconds as ``"11.9 years"``."""

from __future__ import annotations

import math
from collections.abc import Mapping
from numbers import Real

from vibrokit.arguments import real
from vibrokit.errors import ParameterError, StructureError, nearest, shown
from vibrokit.text_table import power_text
from vibrokit.text_units import split_number

_MINUTE, _HOUR, _DAY = 60.0, 3600.0, 86400.0
_YEAR = 365.25 * _DAY
_UNITS: Mapping[str, float] = {
    "ns": 1e-9, "us": 1e-6, "µs": 1e-6, "μs": 1e-6, "ms": 1e-3,
    "s": 1.0, "sec": 1.0, "second": 1.0, "seconds": 1.0,
    "min": _MINUTE, "minute": _MINUTE, "minutes": _MINUTE,
    "h": _HOUR, "hr": _HOUR, "hour": _HOUR, "hours": _HOUR,
    "d": _DAY, "day": _DAY, "days": _DAY, "week": 7 * _DAY, "weeks": 7 * _DAY,
    "a": _YEAR, "y": _YEAR, "yr": _YEAR, "year": _YEAR, "years": _YEAR,
}  # fmt: skip
_PERIODS = ("period", "periods")
_SHOWN = (("years", _YEAR, 2.0), ("days", _DAY, 2.0), ("hours", _HOUR, 2.0), ("minutes", _MINUTE, 2.0))


def seconds_in(text: object, period: float | None = None) -> float:
    """Return a duration in seconds: a number, or a number with a unit, such as ``"8 h"`` or ``"12 periods"``.

    `period` is the section interval (s). Raises ParameterError for what is no positive finite duration.
    """
    example = "give a number of seconds, or a number with a unit, such as '8 h' or '1 yr'"
    if isinstance(text, Real) and not isinstance(text, bool):
        number, unit = real(text), "s"
    else:
        split = split_number(text) if isinstance(text, str) else None
        if split is None:
            raise ParameterError(f"The duration {shown(text)} is not one; {example}.")
        number, unit = split[0], split[1] or "s"
    if unit.lower() in _PERIODS:
        if period is None:
            raise ParameterError(f"The duration {shown(text)} is in periods, and the scene has no section; {example}.")
        scale = period
    elif unit in _UNITS or unit.lower() in _UNITS:
        scale = _UNITS.get(unit) or _UNITS[unit.lower()]
    else:
        raise ParameterError(
            f"The unit {unit!r} of the duration {shown(text)} is unknown{nearest(unit, (*_UNITS, *_PERIODS))}"
        )
    if not 0 < number * scale < math.inf:
        raise ParameterError(f"The duration {shown(text)} must be positive and finite; {example}.")
    return number * scale


def required_time(mean_time: float | str, period: float) -> float:
    """Return a mean time that a state has to last (s); raises StructureError if it is shorter than a period."""
    time = seconds_in(mean_time, period=period)
    if time < period:
        raise StructureError(
            f"mean_time must be a period at least ({period:g} s), for exits are counted once in a period, got "
            f"{shown(mean_time)}."
        )
    return time


def duration_text(log_seconds: float) -> str:
    """Return a duration in the unit that reads best, given ln of it in seconds: it may exceed the largest float."""
    if not math.isfinite(log_seconds):
        return "0 s" if log_seconds < 0 else power_text(log_seconds)
    name, scale = _unit_of(log_seconds)
    return f"{power_text(log_seconds - math.log(scale))} {name}"


def interval_text(log_seconds: float, log_lower: float, log_upper: float) -> str:
    """Return a duration with its interval, such as ``"0.24 s (0.22 to 0.27)"``, from ln of each (s).

    All are in one unit, unless the interval spans more than six decades.
    """
    if not math.isfinite(log_seconds):
        return duration_text(log_seconds)
    if log_upper - log_lower > math.log(1e6):
        value, lower, upper = map(duration_text, (log_seconds, log_lower, log_upper))
        return f"{value} ({lower} to {upper})"
    name, scale = _unit_of(log_seconds)
    value, lower, upper = (power_text(each - math.log(scale)) for each in (log_seconds, log_lower, log_upper))
    return f"{value} {name} ({lower} to {upper})"


def _unit_of(log_seconds: float) -> tuple[str, float]:
    found = ((name, scale) for name, scale, least in _SHOWN if log_seconds >= math.log(least * scale))
    return next(found, ("s", 1.0))
