"""How parameters and units are written, and the units in which a user may give or see what is in SI base units."""

from __future__ import annotations

import contextlib
import math
import re
import unicodedata
from collections.abc import Mapping

from vibrokit.errors import ParameterError, shown

_GRAVITY = 9.80665  # m s⁻², standard
_SIZES: Mapping[str, Mapping[str, float]] = {
    "s^-1": {"Hz": 2 * math.pi, "kHz": 2e3 * math.pi, "rad/s": 1.0},
    "m": {"m": 1.0, "mm": 1e-3, "µm": 1e-6, "um": 1e-6, "nm": 1e-9},
    "m s^-2": {"m/s²": 1.0, "m/s^2": 1.0, "g": _GRAVITY},
    # Noise may be given by its one-sided spectral density, which is 2 D.
    "m^2 s^-3": {
        "m²/s³": 1.0, "m^2/s^3": 1.0, "(m/s²)²/Hz": 0.5, "(m/s^2)^2/Hz": 0.5,
        "g²/Hz": _GRAVITY**2 / 2, "g^2/Hz": _GRAVITY**2 / 2,
    },
    "rad": {"rad": 1.0, "deg": math.pi / 180, "°": math.pi / 180},
}  # fmt: skip
_EXPONENT = re.compile(r"\^\(?([-+]?[0-9]+(?:/[0-9]+)?)\)?")
_RAISED = str.maketrans("-0123456789/", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹ᐟ")
_NUMBER = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(\S*)\s*")


def unit_text(unit: str) -> str:
    """Return a unit such as ``"m^2 s^(-1/2)"`` with raised exponents."""
    return _EXPONENT.sub(lambda match: match[1].translate(_RAISED), unit)


def symbol_text(name: str) -> str:
    """Return the name of a symbol with a Greek letter as such: ``"omega_n"`` is ω_n."""
    stem, *rest = name.split("_")
    with contextlib.suppress(KeyError):  # no Greek letter has this name
        stem = unicodedata.lookup(f"GREEK SMALL LETTER {'lamda' if stem == 'lambda' else stem}")
    return "_".join((stem, *rest))


def parameter_text(path: str, symbol: str, unit: str | None) -> str:
    """Return what an axis or a column of a parameter is called: its path, its symbol and its unit if it has one."""
    named = f"{path} {symbol_text(symbol)}" if symbol else path
    return f"{named} ({unit_text(unit)})" if unit else named


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


def length_unit(largest: float) -> str:
    """Return the unit in which lengths (m) up to a largest one are read most easily."""
    return _readable_unit(largest, "m") or ("nm" if largest > 0 else "m")


def familiar(value: float, base: str | None) -> str:
    """Return a number in SI base units in the unit in which it reads best, such as ``"40 Hz"``; empty for SI itself."""
    name = _readable_unit(value, base)
    size = _SIZES[base or ""][name] if name else 1.0
    return "" if size == 1.0 else f"{value / size:.6g} {name}"


def _readable_unit(value: float, base: str | None) -> str:
    """The largest unit of which a number in SI base units is a tenth or more; empty if there is none."""
    fitting = {name: size for name, size in _SIZES.get(base or "", {}).items() if abs(value) >= 0.1 * size}
    return max(fitting, key=fitting.__getitem__, default="")


def split_number(text: str) -> tuple[float, str] | None:
    """Return the number that a text begins with and the unit behind it; None if there is no number."""
    match = _NUMBER.fullmatch(text)
    return None if match is None else (float(match[1]), match[2])


def number_in(text: str, base: str | None) -> tuple[float, str | None]:
    """Return the number that a text such as ``"42 Hz"`` stands for, in SI base units, and its unit if it has one.

    Raises
    ------
    ParameterError
        The text is no number, or the unit is not one of a parameter in these base units.
    """
    split = split_number(text)
    if split is None:
        raise ParameterError(f"{shown(text)} is no number; give one such as 0.57, or with a unit, such as '42 Hz'.")
    number, unit = split
    return (number * size_of(unit, base), unit) if unit else (number, None)
