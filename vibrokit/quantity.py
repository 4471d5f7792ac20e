"""Quantities: numbers with units, read by Pint where a parameter declares a unit. Without one, Pint is not imported."""

from __future__ import annotations

import contextlib
import math
import re
from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any, Self

from vibrokit.errors import ParameterError, shown
from vibrokit.units import Unit, in_words, is_of_pint, unit_of, written

_LONGEST = 100  # characters
_NUMBER = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*", re.ASCII | re.DOTALL)
_INTENSITY = {"meter": 2.0, "second": -3.0}
_EXAMPLES: Mapping[str, str] = {
    "rad s^-1": "Hz or rad/s",
    "s^-1": "1/s",
    "m": "mm",
    "s": "ms or h",
    "kg": "kg or g",
    "rad": "deg",
    "m s^-2": "m/s^2 or g_n",
    "m^2 s^-3": "(m/s^2)^2/Hz or g_n^2/Hz",
    "": "%",
}


class Quantity(float):
    """A number that was given with a unit: its value in SI base units, per unit mass of the scene where that is due.

    It behaves as a float, and what is computed from it is one. A part has it before a scene knows the mass; until
    then a force in N is `pending`, and its value is that in N.

    Attributes
    ----------
    text : str
        As it was given, such as ``"22 kN/m"``.
    given : float
        Value in SI base units, not divided by the mass.
    mass_power : int
        Power of the mass that it is divided by: 1 for a force and its coefficients, 2 for a spectral density of force.
    mass : float or None
        The mass (kg), if it is known.
    """

    __slots__ = ("given", "mass", "mass_power", "text")

    text: str
    given: float
    mass_power: int
    mass: float | None

    def __new__(cls, text: str, given: float, mass_power: int = 0, mass: float | None = None) -> Self:
        """Make a quantity of its attributes; `read` makes one of a text."""
        quantity = super().__new__(cls, given if mass is None or not mass_power else per_mass(given, mass, mass_power))
        quantity.text, quantity.given, quantity.mass_power, quantity.mass = text, given, mass_power, mass
        return quantity

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.text, self.given, self.mass_power, self.mass)

    def __repr__(self) -> str:
        return repr(self.text)

    def __str__(self) -> str:
        return self.text

    @property
    def unit(self) -> str:
        """The unit that it was given in, such as ``"kN/m"``."""
        return unit_in(self.text)

    @property
    def pending(self) -> bool:
        """Whether the mass that it is to be divided by is not known yet."""
        return self.mass_power > 0 and self.mass is None

    def of_mass(self, mass: float | None) -> Quantity:
        """Return the quantity for a mass (kg), whatever it was divided by before."""
        return Quantity(self.text, self.given, self.mass_power, None if mass is None else float(mass))


def per_mass(value: float, mass: float, power: int) -> float:
    """Return a value divided by a power of the mass; infinite or 0 where that is no number of double precision."""
    try:
        return value / mass**power
    except (OverflowError, ZeroDivisionError):  # of the power
        return value / mass / mass


def is_quantity(value: Any) -> bool:
    """Whether a value is a number with a unit: a text that begins with a number and goes on, or a quantity of Pint."""
    if isinstance(value, str):
        match = _NUMBER.fullmatch(value[: _LONGEST + 1])
        return match is not None and bool(match[2])
    return isinstance(value, Quantity) or is_of_pint(value)


def read(owner: str, value: Any, unit: str | None, mass_power: int | None = None) -> Quantity:
    """Return a number with a unit as a quantity of a parameter.

    Hertz count cycles: they are 2π rad/s where the unit of the parameter has radians, and a density per hertz is
    one-sided, which is 2 D.

    Parameters
    ----------
    owner : str
        What the number belongs to, for messages.
    value : str, Quantity or quantity of Pint
        As of `is_quantity`.
    unit : str or None
        Unit that the parameter declares.
    mass_power : int, optional
        Power of the mass that the value may be divided by; by default 1 for units with s^-2, 2 for m^2 s^-3, else 0.

    Raises
    ------
    ParameterError
        The unit is unknown or of another dimension.
    """
    try:
        text = _text(value)
        number, power = _compared(text, unit, mass_power)
    except ParameterError as error:
        raise ParameterError(f"{owner} {error}") from None
    return Quantity(text, number, power, value.mass if isinstance(value, Quantity) else None)


def number_in(
    owner: str, text: str, unit: str | None, mass: float | None = None, mass_power: int | None = None
) -> tuple[float, str | None]:
    """Return the number that a text such as ``"42 Hz"`` stands for, in SI base units, and its unit if it has one.

    Forces are divided by a mass (kg); `mass_power` as of `read`.

    Raises
    ------
    ParameterError
        The text is no number, the unit is not one of a parameter in this unit, or it needs a mass.
    """
    try:
        number, name = _split(text)
        if not name:
            return float(number), None
        value, power = _compared(text.strip(), unit, mass_power)
    except ParameterError as error:
        raise ParameterError(f"{owner} {error}") from None
    found = Quantity(text, value, power, mass)
    if found.pending:
        raise ParameterError(f"{owner} is {text}, which needs a mass; give the scene one, such as mass='0.35 kg'.")
    return float(found), name


def size_of(
    unit: str, base: str | None, mass: float | None = None, mass_powers: Sequence[int | None] = (1, 2, None)
) -> float:
    """Return the size of a unit in the SI base units of a parameter, such as 2π for Hz and ``"rad s^-1"``.

    `mass_powers` are those that are tried, as of `read`: by default any, because values that are shown have been read.

    Raises
    ------
    ParameterError
        As of `number_in`.
    """
    if not isinstance(unit, str):
        raise ParameterError(f"a unit is given as text, such as 'mm', got {shown(unit)}.")
    *others, last = mass_powers
    for power in others:
        with contextlib.suppress(ParameterError):
            return number_in("unit", f"1 {unit}", base, mass, power)[0]
    return number_in("unit", f"1 {unit}", base, mass, last)[0]


def unit_in(text: str) -> str:
    """Return the unit of a quantity as text."""
    return _split(text)[1]


def _compared(text: str, unit: str | None, mass_power: int | None) -> tuple[float, int]:
    """The value of a text in SI base units, and the power of the mass by which it exceeds a unit."""
    number, name = _split(text)
    if unit is None:
        raise ParameterError(f"declares no unit; give a number without one, got {shown(text)}.")
    wanted, given = _declared(unit), _unit(name, unit)
    power = _mass_power(wanted) if mass_power is None else mass_power
    mass = given.powers.get("kilogram", 0.0) - wanted.powers.get("kilogram", 0.0)
    divided = {name: exponent - mass * (name == "kilogram") for name, exponent in given.powers.items()}
    if mass not in (0, power) or not _alike(divided, wanted.powers):
        raise ParameterError(_wrong_dimension(text, given, unit, wanted, power))
    value = float(number)
    if value and math.isfinite(value):
        try:
            value = float(Fraction(number) * given.size)  # exact: 0.3 mm are 3e-4
        except OverflowError:
            value = math.copysign(math.inf, value)
    return value * _of_cycles(text, given, unit, wanted), int(mass)


def _text(value: Any) -> str:
    """A quantity as text."""
    if isinstance(value, str):
        return value.strip()
    if isinstance(value, Quantity):
        return value.text
    try:
        return written(value)
    except (TypeError, ValueError, OverflowError):
        raise ParameterError(f"must be one real number with its unit, got {shown(value)}.") from None


def _split(text: str) -> tuple[str, str]:
    match = _NUMBER.fullmatch(text[: _LONGEST + 1])
    if match is None or len(text) > _LONGEST:
        raise ParameterError(f"must be a number, or a number with a unit, such as '0.25 mm', got {shown(text)}.")
    return match[1], match[2]


def _declared(unit: str) -> Unit:
    found = unit_of(unit) if unit else Unit(Fraction(1), {}, 0.0)
    if found is None:
        raise ParameterError(f"has the unit {unit}, which no other is compared with; give a number without a unit.")
    return found


def _unit(name: str, wanted: str) -> Unit:
    found = unit_of(name)
    if found is None:
        raise ParameterError(f"has the unknown unit {shown(name)}; allowed are units of {_allowed(wanted)}.")
    return found


def _mass_power(wanted: Unit) -> int:
    """Power of the mass by which a quantity may exceed a unit, as is usual for that unit."""
    if _alike(wanted.powers, _INTENSITY):
        return 2
    return int(wanted.powers.get("second") == -2.0)


def _alike(one: Mapping[str, float], other: Mapping[str, float]) -> bool:
    """Whether the dimensions are the same; angles have none."""
    names = (one.keys() | other.keys()) - {"radian"}
    return all(math.isclose(one.get(name, 0.0), other.get(name, 0.0), abs_tol=1e-9) for name in names)


def _of_cycles(text: str, given: Unit, unit: str, wanted: Unit) -> float:
    """What a value is multiplied by because hertz and radians are not merely 1/s and 1."""
    angle, angular = given.powers.get("radian", 0.0), wanted.powers.get("radian", 0.0)
    if given.cycles == wanted.cycles and angle in (0.0, angular):
        return 1.0
    if given.cycles == 1.0 and angular == 1.0 and not angle:
        return 2 * math.pi
    if given.cycles == -1.0 and not wanted.cycles and not angle and _alike(wanted.powers, _INTENSITY):
        return 0.5
    raise ParameterError(
        f"is {shown(text)}, and hertz and radians have no meaning in a parameter in {unit or 'no unit'} that is no "
        f"angular frequency; allowed are units of {_allowed(unit)}."
    )


def _wrong_dimension(text: str, given: Unit, unit: str, wanted: Unit, power: int) -> str:
    massive = {**wanted.powers, "kilogram": wanted.powers.get("kilogram", 0.0) + power}
    heavier = f", or {in_words(massive)} with the mass of the scene" if power else ""
    gram = "; g is the gram, and g_n the standard gravity" if re.search(r"\bg\b", _split(text)[1]) else ""
    force = ", or of force, such as N" if power == 1 and unit == "m s^-2" else ""
    return (
        f"must be {f'in {unit}' if unit else 'without a dimension'}{heavier}, got {shown(text)}, which is in "
        f"{in_words(given.powers)}{gram}; allowed are units of {_allowed(unit)}{force}."
    )


def _allowed(unit: str) -> str:
    return f"{unit or '1'}, such as {_EXAMPLES[unit]}" if unit in _EXAMPLES else unit
