"""Durations as text: ``"8 h"`` in seconds, and seconds as ``"11.9 years"``."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from numbers import Real

from vibrokit.errors import ParameterError, nearest, shown

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
_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*([^\W\d_]*)\s*")
_SHOWN = (("years", _YEAR, 2.0), ("days", _DAY, 2.0), ("hours", _HOUR, 2.0), ("minutes", _MINUTE, 2.0))
_PLAIN = math.log(1e6)  # numbers up to a million, and down to its inverse, are written out


def seconds_in(text: object, period: float | None = None) -> float:
    """Return a duration in seconds.

    Parameters
    ----------
    text : str or float
        A number of seconds, or a number with a unit: ``"8 h"``, ``"1yr"``, ``"30 min"``, ``"12 periods"``.
    period : float, optional
        Section interval (s), for numbers of periods.

    Raises
    ------
    ParameterError
        It is not a positive finite duration, the unit is unknown, or periods are given and there is no section.
    """
    example = "give a number of seconds, or a number with a unit, such as '8 h' or '1 yr'"
    if isinstance(text, Real) and not isinstance(text, bool):
        number, unit = float(text), "s"
    else:
        match = _NUMBER.fullmatch(text) if isinstance(text, str) else None
        if match is None:
            raise ParameterError(f"The duration {shown(text)} is not one; {example}.")
        number, unit = float(match[1]), match[2] or "s"
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


def duration_text(seconds: float, period: float | None = None) -> str:
    """Return a duration (s) in the unit that reads best, and in periods (s each) if there are any."""
    if not seconds > 0:
        return "0 s" if seconds == 0 else "unknown"
    return "infinite" if math.isinf(seconds) else log_duration_text(math.log(seconds), period)


def log_duration_text(log_seconds: float, period: float | None = None) -> str:
    """Return the same, given ln of the duration in seconds: it may exceed the largest float."""
    if math.isnan(log_seconds):
        return "unknown"
    if math.isinf(log_seconds):
        return "infinite" if log_seconds > 0 else "0 s"
    name, scale = _unit_of(log_seconds)
    text = f"{_number(log_seconds - math.log(scale))} {name}"
    return text if period is None else f"{text} ({_number(log_seconds - math.log(period))} periods)"


def interval_text(log_seconds: float, log_lower: float, log_upper: float) -> str:
    """Return a duration with its interval in one unit, such as ``"0.24 s (0.22 to 0.27)"``, from ln of each (s)."""
    if not math.isfinite(log_seconds):
        return log_duration_text(log_seconds)
    name, scale = _unit_of(log_seconds)
    value, lower, upper = (_number(each - math.log(scale)) for each in (log_seconds, log_lower, log_upper))
    return f"{value} {name} ({lower} to {upper})"


def _unit_of(log_seconds: float) -> tuple[str, float]:
    found = ((name, scale) for name, scale, least in _SHOWN if log_seconds >= math.log(least * scale))
    return next(found, ("s", 1.0))


def _number(logarithm: float) -> str:
    """A number of any size, given its natural logarithm."""
    if math.isnan(logarithm):
        return "unknown"
    if math.isinf(logarithm):
        return "infinite" if logarithm > 0 else "0"
    if abs(logarithm) <= _PLAIN:
        number = float(f"{math.exp(logarithm):.3g}")
        return f"{number:.0f}" if number >= 1000 else f"{number:.3g}"
    if abs(logarithm) < 50 * math.log(10):
        return f"{math.exp(logarithm):.3g}"
    return f"10^{logarithm / math.log(10):.0f}"
