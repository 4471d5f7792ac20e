"""Units: names, products and powers as text, which Pint knows; Pint is imported when the first is read."""

from __future__ import annotations

import functools
import math
import re
import sys
from collections.abc import Mapping
from fractions import Fraction
from typing import Any, NamedTuple

# Names, products, quotients and small exponents, and no brackets in brackets: Pint would compute a tower of powers, or
# powers of powers, for ever.
_EXPONENT = r"\^\s*(?:[-+]?\d{1,2}(?:\.\d{1,6})?|\(\s*[-+]?\d{1,2}(?:\.\d{1,6}|\s*/\s*\d{1,2})?\s*\))(?!\s*\^)"
_UNIT = re.compile(rf"(?:1\s*/)?(?:[^\W\d]\w*+|[°%]|[\s*/()]|{_EXPONENT})+")
_RAISED = re.compile("[⁺⁻⁰¹²³⁴-⁹]+")
_PLAIN = str.maketrans("⁺⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "+-0123456789")


class Unit(NamedTuple):
    """A unit as Pint knows it."""

    size: Fraction  # in SI base units
    powers: Mapping[str, float]  # of the base units, by Pint's names
    cycles: float  # power of the hertz in it, which Pint takes for 1/s


def is_of_pint(value: Any) -> bool:
    """Whether a value is a quantity of Pint, of any registry."""
    pint = sys.modules.get("pint")  # a program that has a quantity of Pint has imported it
    return pint is not None and isinstance(value, pint.Quantity)


def written(quantity: Any) -> str:
    """Return a quantity of Pint as text; raises TypeError or ValueError if it is not one real number."""
    number = repr(float(quantity.magnitude)).removesuffix(".0")
    size = float((1.0 * quantity.units).to_base_units().magnitude)
    for unit in (f"{quantity.units:~D}", f"{quantity.units:D}"):  # a short name may be that of two units
        plain = unit.replace(" / ", "/").replace(" ** ", "^").replace(" * ", " ") or "dimensionless"
        known = unit_of(plain)
        if known is not None and math.isclose(float(known.size), size, rel_tol=1e-9):
            return f"{number} {plain}"
    raise ValueError("the unit is another one in this registry")


@functools.cache
def _registry() -> Any:
    import pint

    return pint.UnitRegistry()


@functools.lru_cache(maxsize=256)
def unit_of(text: str) -> Unit | None:
    """A unit as text; None if Pint knows none of this name, or only one with another zero."""
    plain = _RAISED.sub(lambda match: f"^{match[0].translate(_PLAIN)}", text.replace("**", "^"))
    plain = re.sub(r"[·⋅×]|(?<=[^\W\d])\.(?=[^\W\d])", "*", plain)
    if not _UNIT.fullmatch(plain) or re.search(r"\([^)]*\(", plain.replace("^(", "^[")):
        return None
    registry = _registry()
    try:
        units = registry.parse_units(plain)
        size, base = registry.get_base_units(units)
        zero = registry.Quantity(0.0, units).to_base_units().magnitude
    except Exception:  # Pint raises what its tokenizer and its arithmetic raise
        return None
    if zero != 0.0 or not 0.0 < size < math.inf:
        return None
    powers = {name: float(power) for name, power in registry.Quantity(1.0, base).unit_items()}
    named = [(registry.parse_unit_name(name)[0][1], power) for name, power in registry.Quantity(1, units).unit_items()]
    return Unit(Fraction(repr(float(size))), powers, float(sum(power for name, power in named if name == "hertz")))


def in_words(powers: Mapping[str, float]) -> str:
    """A product of base units: ``"kg s^-2"``."""
    order = {"kilogram": 0, "meter": 1, "second": 2}
    names = sorted((name for name in powers if powers[name]), key=lambda name: (order.get(name, 3), name))
    factors = [(_registry().get_symbol(name), powers[name]) for name in names]
    return " ".join(name if power == 1.0 else f"{name}^{power:g}" for name, power in factors) or "no unit"
