"""Durations as text: ``"8 h"`` in seconds, and seconds as ``"11.9 years"``."""

from __future__ import annotations

import math

from vibrokit.arguments import real
from vibrokit.errors import ParameterError, StructureError, shown
from vibrokit.quantity import number_in
from vibrokit.text_table import power_text

_MINUTE, _HOUR, _DAY = 60.0, 3600.0, 86400.0
_YEAR = 365.25 * _DAY
_PERIODS = ("period", "periods")
_SHOWN = (("years", _YEAR, 2.0), ("days", _DAY, 2.0), ("hours", _HOUR, 2.0), ("minutes", _MINUTE, 2.0))


def seconds_in(text: object, period: float | None = None) -> float:
    """Return a duration in seconds: a number, or a number with a unit, such as ``"8 h"`` or ``"12 periods"``.

    `period` is the section interval (s). Raises ParameterError for what is no positive finite duration.
    """
    example = "give a number of seconds, or a number with a unit, such as '8 h' or '1 yr'"
    owner, seconds = f"The duration {shown(text)}", math.nan
    if isinstance(text, str):
        words = text.lower().split()
        if words[1:] and words[-1] in _PERIODS:
            if period is None:
                raise ParameterError(f"{owner} is in periods, and the scene has no section; {example}.")
            seconds = number_in(owner, words[0], "s")[0] * period
        else:
            seconds = _of_text(owner, text)
    elif not isinstance(text, bool):
        seconds = real(text)
    if not 0 < seconds < math.inf:
        raise ParameterError(f"{owner} must be positive and finite; {example}.")
    return seconds


def _of_text(owner: str, text: str) -> float:
    """Seconds of a text, whose unit may have capital letters where none are meant."""
    try:
        return number_in(owner, text, "s")[0]
    except ParameterError:
        if text == text.lower():
            raise
    return number_in(owner, text.lower(), "s")[0]


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
