"""How parameters and units are written, and the units in which numbers in SI base units read best."""

from __future__ import annotations

import contextlib
import math
import re
import unicodedata
from collections.abc import Mapping

STANDARD_GRAVITY = 9.80665
"""In m s⁻²."""
_READABLE: Mapping[str, Mapping[str, float]] = {
    "rad s^-1": {"Hz": 2 * math.pi, "kHz": 2e3 * math.pi},
    "m": {"m": 1.0, "mm": 1e-3, "µm": 1e-6, "nm": 1e-9},
    "m s^-2": {"m/s²": 1.0, "g_n": STANDARD_GRAVITY},
    # The one-sided spectral density is 2 D.
    "m^2 s^-3": {"m²/s³": 1.0, "(m/s²)²/Hz": 0.5, "g_n²/Hz": STANDARD_GRAVITY**2 / 2},
    "rad": {"rad": 1.0, "deg": math.pi / 180},
}
_EXPONENT = re.compile(r"\^\(?([-+]?[0-9]+(?:/[0-9]+)?)\)?")
_RAISED = str.maketrans("-0123456789/", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹ᐟ")


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


def length_unit(largest: float) -> tuple[str, float]:
    """Return the unit in which lengths (m) up to a largest one are read most easily, and its size (m)."""
    name = _readable_unit(largest, "m") or ("nm" if largest > 0 else "m")
    return name, _READABLE["m"][name]


def familiar(value: float, base: str | None) -> str:
    """Return a number in SI base units in the unit in which it reads best, such as ``"40 Hz"``; empty for SI itself."""
    name = _readable_unit(value, base)
    size = _READABLE[base or ""][name] if name else 1.0
    return "" if size == 1.0 else f"{value / size:.6g} {name}"


def _readable_unit(value: float, base: str | None) -> str:
    """The largest unit of which a number in SI base units is a tenth or more; empty if there is none."""
    fitting = {name: size for name, size in _READABLE.get(base or "", {}).items() if abs(value) >= 0.1 * size}
    return max(fitting, key=fitting.__getitem__, default="")
