"""Units in which a user may give or see a parameter that is in SI base units."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

from vibrokit.errors import ParameterError, shown

_SIZES: Mapping[str, Mapping[str, float]] = {
    "s^-1": {"Hz": 2 * math.pi, "kHz": 2e3 * math.pi, "rad/s": 1.0},
    "m": {"m": 1.0, "mm": 1e-3, "µm": 1e-6, "um": 1e-6, "nm": 1e-9},
}
_NUMBER = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(\S*)\s*")


def size_of(unit: str, base: str | None) -> float:
    """Return the size of a unit in the SI base units of a parameter, such as 2π for Hz and ``"s^-1"``.

    Raises
    ------
    ParameterError
        A parameter of these base units has no such unit.
    """
    known = _SIZES.get(base or "", {})
    if unit not in known:
        allowed = ", ".join(known) or "SI base units only"
        raise ParameterError(f"{shown(unit)} is no unit of a parameter in {base or 'no unit'}; allowed are {allowed}.")
    return known[unit]


def familiar(value: float, base: str | None) -> str:
    """Return a number in SI base units in the largest other unit in which it is 1 at least, such as ``"40 Hz"``."""
    fitting = {name: size for name, size in _SIZES.get(base or "", {}).items() if abs(value) >= size}
    name = max(fitting, key=fitting.__getitem__, default="")
    return "" if fitting.get(name, 1.0) == 1.0 else f"{value / fitting[name]:.6g} {name}"


def number_in(text: str, base: str | None) -> tuple[float, str | None]:
    """Return the number that a text such as ``"42 Hz"`` stands for, in SI base units, and its unit if it has one.

    Raises
    ------
    ParameterError
        The text is no number, or the unit is not one of a parameter in these base units.
    """
    match = _NUMBER.fullmatch(text)
    if match is None:
        raise ParameterError(f"{shown(text)} is no number; give one such as 0.57, or with a unit, such as '42 Hz'.")
    unit = match[2] or None
    return float(match[1]) * (1.0 if unit is None else size_of(unit, base)), unit
