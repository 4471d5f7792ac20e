"""Parameters: name, symbol, unit and allowed range."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Mapping
from fractions import Fraction
from typing import Any, NamedTuple

from vibrokit.arguments import real
from vibrokit.construction import called
from vibrokit.errors import ParameterError, shown
from vibrokit.parts.formula import evaluate
from vibrokit.quantity import Quantity, is_quantity, number_in, read, size_of

_KEY = "vibrokit.parameter"
_NAMED = re.compile(r"\^\(([^()]*[^\W\d_][^()]*)\)")  # an exponent in which a parameter stands


@dataclasses.dataclass(frozen=True)
class Parameter:
    """Declaration of one parameter of a part.

    Attributes
    ----------
    name : str
        Name in the constructor and in scene files.
    attribute : str
        Field of the part that holds it; differs from the name if a method has that name.
    symbol : str
        Symbol in equations, as SymPy writes it (``"k"``, ``"omega"``).
    unit : str or None
        Unit in SI base units, in which a value without a unit is; ``""`` if dimensionless, None if undeclared. An
        angular frequency is in ``"rad s^-1"``: only then may it be given in Hz.
    minimum, above, maximum : float or None
        Allowed range: value ≥ minimum, value > above, value ≤ maximum.
    structural : bool
        True if the form of the equations depends on the value (an exponent, a formula); changing it triggers
        recompilation.
    mass_power : int or None
        Power of the mass that a value with a unit is divided by if its unit has the mass in it. None is 1 for units
        with s^-2, such as that of a force or a stiffness per unit mass, 2 for m^2 s^-3, and 0 for others; give 1 to
        a damping per unit mass, in s^-1, and 0 to an acceleration of a support.
    """

    name: str
    attribute: str
    symbol: str
    unit: str | None
    minimum: float | None = None
    above: float | None = None
    maximum: float | None = None
    structural: bool = False
    mass_power: int | None = None

    @property
    def allowed(self) -> str:
        """The allowed range, for messages."""
        words = []
        if self.above is not None:
            words.append(f"greater than {self.above:g}")
        if self.minimum is not None:
            words.append(f"at least {self.minimum:g}")
        if self.maximum is not None:
            words.append(f"at most {self.maximum:g}")
        return "a finite number" + (" " + " and ".join(words) if words else "")

    def checked(self, owner: str, value: Any) -> float:
        """Return `value` as a float; raise ParameterError if it is not a number in the allowed range.

        A number with a unit, as text or of Pint, is a `Quantity`.
        """
        number = self._quantity(owner, value) if is_quantity(value) else real(value)
        outside = (
            not math.isfinite(number)
            or (self.minimum is not None and number < self.minimum)
            or (self.above is not None and number <= self.above)
            or (self.maximum is not None and number > self.maximum)
        )
        if outside:
            large = number == math.inf and not isinstance(value, float)
            given = "one above 1.8e308" if large else shown(value) if math.isnan(number) else f"{number:g}"
            raise ParameterError(f"{owner}: {self.name} must be {self.allowed}, got {given}.")
        return number

    def with_exponents(self, values: Mapping[str, Any]) -> Parameter:
        """Return the declaration with numbers in the exponents of its unit: ``"m^(1-n) s^-2"`` for a value of n.

        `values` are those of the parameters of the part, by symbol.
        """
        if self.unit is None or not _NAMED.search(self.unit):
            return self

        def exponent(match: re.Match[str]) -> str:
            return f"^({Fraction(evaluate(match[1], values)).limit_denominator(1000)})"

        try:
            return dataclasses.replace(self, unit=_NAMED.sub(exponent, self.unit))
        except (LookupError, TypeError, ValueError, ArithmeticError, SyntaxError):  # no formula, or no number
            return self

    def known(self, owner: str, value: Any) -> float:
        """Return `value` as `checked` does, for a computation; ParameterError if it waits for the mass of a scene."""
        number = self.checked(owner, value)
        if isinstance(number, Quantity) and number.pending:
            raise ParameterError(
                f"{owner}: {self.name} is {number.text} and is computed with before a scene gives the mass; divide it "
                f"by the mass, and give it in {self.unit}."
            )
        return float(number)

    def _quantity(self, owner: str, value: Any) -> float:
        number = read(f"{owner}: {self.name}", value, self.unit, self.mass_power)
        if not self.structural:
            return number
        if number.pending:
            raise ParameterError(
                f"{owner}: {self.name} shapes the equations, so that it cannot be divided by the mass later; give it "
                f"per unit mass, in {self.unit}, got {number.text}."
            )
        return float(number)

    def number_in(self, owner: str, text: str, mass: float | None) -> tuple[float, str | None]:
        """Return the number that a text stands for, and its unit if it has one, for a mass (kg)."""
        return number_in(owner, text, self.unit, mass, self.mass_power)

    def size_of(self, unit: str, mass: float | None) -> float:
        """Return the size in SI of a unit that the parameter may be given in; ParameterError for any other."""
        return size_of(unit, self.unit, mass, (self.mass_power,))


class Entry(NamedTuple):
    """One parameter of a scene: its path, its declaration and its value."""

    path: str
    declared: Parameter
    value: Any


@called
def parameter(
    symbol: str,
    unit: str,
    *,
    minimum: float | None = None,
    above: float | None = None,
    maximum: float | None = None,
    structural: bool = False,
    mass_power: int | None = None,
    default: Any = dataclasses.MISSING,
    name: str = "",
) -> Any:
    """Declare a field of a part as a parameter; arguments as for `Parameter`.

    Examples
    --------
    >>> class Cubic(ContactLaw):
    ...     stiffness: float = parameter("k", "m^-2 s^-2", minimum=0)
    """
    declared = Parameter(name, "", symbol, unit, minimum, above, maximum, structural, mass_power)
    return dataclasses.field(default=default, metadata={_KEY: declared})


def declared_parameters(cls: type) -> tuple[Parameter, ...]:
    """Parameters of a dataclass in field order; a field declared without `parameter` accepts any finite number."""
    # A second dataclass decorator drops the metadata of inherited fields, but not the declarations of the base class.
    inherited = {d.attribute: d for base in reversed(cls.__mro__[1:]) for d in vars(base).get("_declared", ())}
    found = []
    for field in dataclasses.fields(cls):
        bare = inherited.get(field.name, Parameter("", "", field.name, None))
        declared = field.metadata.get(_KEY, bare)
        found.append(dataclasses.replace(declared, name=declared.name or field.name, attribute=field.name))
    return tuple(found)
