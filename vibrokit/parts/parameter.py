"""Parameters: what each is called, its unit, and the values that it may have."""

from __future__ import annotations

import dataclasses
import math
from numbers import Real
from typing import Any

from vibrokit.errors import ParameterError, shown

_KEY = "vibrokit.parameter"


@dataclasses.dataclass(frozen=True)
class Parameter:
    """Declaration of one parameter of a part.

    Attributes
    ----------
    name : str
        Name in the constructor and in scene files.
    attribute : str
        Field that holds it; the same name, unless a method has that one.
    symbol : str
        Letter in equations, as SymPy writes it (``"k"``, ``"omega"``).
    unit : str or None
        Unit in SI base units; ``""`` is dimensionless, None is undeclared.
    minimum, above, maximum : float or None
        Allowed range: at least, strictly more than, at most.
    structural : bool
        True if the value shapes the equations (an exponent, a formula): it stays in them, and another value
        means other compiled code.
    """

    name: str
    attribute: str
    symbol: str
    unit: str | None
    minimum: float | None = None
    above: float | None = None
    maximum: float | None = None
    structural: bool = False

    @property
    def allowed(self) -> str:
        """The allowed range in words."""
        words = []
        if self.above is not None:
            words.append(f"greater than {self.above:g}")
        if self.minimum is not None:
            words.append(f"at least {self.minimum:g}")
        if self.maximum is not None:
            words.append(f"at most {self.maximum:g}")
        return "a finite number" + (" " + " and ".join(words) if words else "")

    def checked(self, owner: str, value: Any) -> float:
        """Return `value` as a float, or raise ParameterError naming owner, parameter, value and range."""
        if isinstance(value, bool) or not isinstance(value, Real):
            raise ParameterError(f"{owner}: {self.name} is {shown(value)}, which is no number; give {self.allowed}.")
        try:
            number = float(value)
        except OverflowError:
            raise ParameterError(f"{owner}: {self.name} is beyond 1.8e308; give {self.allowed}.") from None
        outside = (
            not math.isfinite(number)
            or (self.minimum is not None and number < self.minimum)
            or (self.above is not None and number <= self.above)
            or (self.maximum is not None and number > self.maximum)
        )
        if outside:
            raise ParameterError(f"{owner}: {self.name} is {number:g}; give {self.allowed}.")
        return number


def parameter(
    symbol: str,
    unit: str,
    *,
    minimum: float | None = None,
    above: float | None = None,
    maximum: float | None = None,
    structural: bool = False,
    default: Any = dataclasses.MISSING,
    name: str = "",
) -> Any:
    """Declare a field of a part as a parameter; the arguments are those of `Parameter`.

    Examples
    --------
    >>> class Cubic(ContactLaw):
    ...     stiffness: float = parameter("k", "m^-2 s^-2", minimum=0)
    """
    declared = Parameter(name, "", symbol, unit, minimum, above, maximum, structural)
    return dataclasses.field(default=default, metadata={_KEY: declared})


def declared_parameters(cls: type) -> tuple[Parameter, ...]:
    """Parameters of a dataclass, in field order; a field declared without `parameter` may have any finite value."""
    # A base class that was decorated a second time has lost the metadata of its fields, but not its declarations.
    inherited = {d.attribute: d for base in reversed(cls.__mro__[1:]) for d in vars(base).get("_declared", ())}
    found = []
    for field in dataclasses.fields(cls):
        bare = inherited.get(field.name, Parameter("", "", field.name, None))
        declared = field.metadata.get(_KEY, bare)
        found.append(dataclasses.replace(declared, name=declared.name or field.name, attribute=field.name))
    return tuple(found)
