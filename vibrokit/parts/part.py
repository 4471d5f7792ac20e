"""Part: base class of contact laws, springs, excitations and noise models."""

from __future__ import annotations

import dataclasses
import functools
import inspect
from abc import ABC
from collections.abc import Callable, Mapping
from numbers import Real
from typing import Any, ClassVar, Self, dataclass_transform

from vibrokit.construction import Constructed
from vibrokit.errors import ArgumentError, ParameterError, nearest
from vibrokit.parts.parameter import Parameter, declared_parameters, parameter
from vibrokit.quantity import Quantity


@dataclass_transform(frozen_default=True, field_specifiers=(parameter, dataclasses.field))
class Part(ABC, metaclass=Constructed):
    """One part of a scene: a frozen dataclass whose fields are its parameters.

    A subclass becomes a frozen dataclass without a decorator. Every class is either abstract or final: a concrete
    part cannot have subclasses.

    For developers
    --------------
    Write the formula method of the abstract class and declare each field with `parameter`. Range checks, scene files,
    derivatives, compiled kernels and the conformance kit follow from these.
    """

    variables: ClassVar[tuple[str, ...]]
    """Names of the arguments of a formula."""
    _declared: ClassVar[tuple[Parameter, ...]] = ()

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        for base in cls.__bases__:
            if issubclass(base, Part) and base._is_final():
                kind = next(b.__name__ for b in base.__mro__[1:] if issubclass(b, Part))
                raise ArgumentError(
                    f"{cls.__name__} inherits from {base.__name__}, which is a concrete part and final; inherit from "
                    f"{kind} and write the whole formula."
                )
        try:
            dataclasses.dataclass(frozen=True, repr=False)(cls)
        except TypeError as error:
            raise ArgumentError(
                f"{cls.__name__} cannot become a dataclass ({error}); declare parameters with a default after those "
                "without one."
            ) from error
        cls._check_fields()
        del cls.__setattr__, cls.__delattr__  # Part has its own; an explicit decorator may add them again
        cls._declared = declared_parameters(cls)

    @classmethod
    def _check_fields(cls) -> None:
        """Refuse a field with the name of something else that every part of its kind has."""
        for base in cls.__mro__[1:]:
            own = {field.name for field in dataclasses.fields(base)} if dataclasses.is_dataclass(base) else set()
            for field in dataclasses.fields(cls):  # type: ignore[arg-type]
                if issubclass(base, Part) and field.name in vars(base) and field.name not in own:
                    raise ArgumentError(
                        f"{cls.__name__}: the field {field.name!r} would hide what every {base.__name__} has by that "
                        "name; give the field another name, and its parameter the name that you want by "
                        f"parameter(..., name={field.name!r})."
                    )

    @classmethod
    def is_ours(cls) -> bool:
        """Whether the class comes with the toolkit."""
        return cls.__module__.startswith("vibrokit.")

    @classmethod
    def _is_final(cls) -> bool:
        return not inspect.isabstract(cls) and ABC not in cls.__bases__

    def __post_init__(self) -> None:
        values = self._by_symbol
        for declared in self._declared:
            value = getattr(self, declared.attribute)
            number = declared.with_exponents(values).checked(type(self).__name__, value)
            exact = declared.structural and isinstance(value, Real) and not isinstance(value, float)
            if not exact:  # a structural Fraction stays what it is
                object.__setattr__(self, declared.attribute, number)

    def __setattr__(self, name: str, value: Any) -> None:
        raise dataclasses.FrozenInstanceError(f"{type(self).__name__}: {name} cannot be set; use replace(...).")

    def __delattr__(self, name: str) -> None:
        raise dataclasses.FrozenInstanceError(f"{type(self).__name__}: {name} cannot be deleted.")

    def declared(self) -> tuple[Parameter, ...]:
        """Parameters of this part, in order; one that stands in an exponent is structural, declared so or not."""
        if self.is_ours():  # declared where they are written; no SymPy is needed to find them
            return self._declared
        fixed = tuple((d.name, self._value(d)) for d in self._declared if d.structural)
        shaping = _exponents(type(self), fixed)
        values = self._by_symbol
        return tuple(
            dataclasses.replace(d.with_exponents(values), structural=d.structural or d.name in shaping)
            for d in self._declared
        )

    @property
    def _by_symbol(self) -> dict[str, Any]:
        return {declared.symbol: getattr(self, declared.attribute) for declared in self._declared}

    def formulas(self, argument: Callable[[str], Any]) -> tuple[Any, ...]:
        """Return all formulas of this part, for arguments that `argument` makes from their names."""
        return (self.force(*map(argument, self.variables)),)  # type: ignore[attr-defined]

    @property
    def parameters(self) -> dict[str, Any]:
        """Parameter values by name."""
        return {declared.name: self._value(declared) for declared in self.declared()}

    @property
    def quantities(self) -> dict[str, Quantity]:
        """Parameter values that were given with a unit, by name."""
        return {name: value for name, value in self._stored().items() if isinstance(value, Quantity)}

    def _stored(self) -> dict[str, Any]:
        """What the fields hold, by the name of each parameter; `parameters` needs SymPy for other people's parts."""
        return {declared.name: getattr(self, declared.attribute) for declared in self._declared}

    def check_settled(self, owner: str) -> None:
        """Raise ParameterError if a number waits for the mass of a scene, so that nothing is computed from it yet."""
        for name, quantity in self.quantities.items():
            if quantity.pending:
                raise ParameterError(
                    f"{owner}: {name} is {quantity.text}, and there is no mass yet; ask the part of a scene that has "
                    "one."
                )

    def of_mass(self, mass: float | None) -> Self:
        """Return the part in a scene of a mass (kg): forces that were given with units are divided by it."""
        divided = {name: value.of_mass(mass) for name, value in self.quantities.items() if value.mass_power}
        return self.replace(**divided) if divided else self

    def _value(self, declared: Parameter) -> Any:
        return getattr(self, declared.attribute)

    def __repr__(self) -> str:
        values = ", ".join(f"{name}={value!r}" for name, value in self.parameters.items())
        return f"{type(self).__name__}({values})"

    def replace(self, **changes: Any) -> Self:
        """Return a checked copy with some parameters changed."""
        known = self.parameters
        for name in changes:
            if name not in known:
                raise ParameterError(f"{type(self).__name__} has no parameter {name!r}{nearest(name, known)}")
        return type(self)(**(known | changes))

    def twin(self, values: Mapping[str, Any]) -> Self:
        """Return an unchecked copy whose parameters are `values` by name, usually SymPy symbols.

        The formula method of the twin returns the formula as a SymPy expression.
        """
        twin = object.__new__(type(self))
        for declared in self._declared:
            object.__setattr__(twin, declared.attribute, values[declared.name])
        return twin


@functools.lru_cache(maxsize=256)
def _exponents(cls: Any, fixed: tuple[tuple[str, Any], ...]) -> frozenset[str]:
    """Return the parameters in exponents of what varies with the arguments of a formula, which decide its smoothness.

    The `fixed` parameters keep their values. A class whose formulas cannot be called with symbols has none here; the
    derivation meets the same error and words it.
    """
    import sympy

    part, known = object.__new__(cls), dict(fixed)
    parameters = {d.name: sympy.Symbol(d.name, positive=True) for d in cls._declared if d.name not in known}
    try:
        found = part.twin(known | parameters).formulas(lambda name: sympy.Dummy(name, real=True))
        powers = [power for formula in found for power in sympy.sympify(formula).atoms(sympy.Pow)]
    except Exception:
        return frozenset()
    varying = [power.exp.free_symbols for power in powers if power.base.atoms(sympy.Dummy)]
    return frozenset(name for name, symbol in parameters.items() if any(symbol in symbols for symbols in varying))
