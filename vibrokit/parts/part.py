"""Part: what contact laws, springs, excitations and noise models have in common."""

from __future__ import annotations

import dataclasses
import inspect
from abc import ABC
from collections.abc import Mapping
from typing import Any, ClassVar, Self, dataclass_transform

from vibrokit.errors import ParameterError
from vibrokit.parts.parameter import Parameter, declared_parameters, parameter


@dataclass_transform(frozen_default=True, field_specifiers=(parameter, dataclasses.field))
class Part(ABC):
    """One piece of a scene: a frozen dataclass whose fields are its parameters.

    A class that inherits from a part becomes a frozen dataclass by itself; no decorator is needed. Every class is
    either abstract or final: a concrete part refuses to be inherited from.

    For developers
    --------------
    Write the formula method of the abstract class and declare each field with `parameter`. From these,
    everything else just works: range checks, scene files, derivatives, compiled kernels, the conformance kit.
    """

    _declared: ClassVar[tuple[Parameter, ...]] = ()

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        for base in cls.__bases__:
            if issubclass(base, Part) and base._is_final():
                kind = next(b.__name__ for b in base.__mro__[1:] if issubclass(b, Part))
                raise TypeError(
                    f"{cls.__name__} inherits from {base.__name__}, a finished part, and finished parts are final; "
                    f"inherit from {kind} instead and write the whole formula."
                )
        dataclasses.dataclass(frozen=True, repr=False)(cls)
        del cls.__setattr__, cls.__delattr__  # those below do, and an explicit decorator may put its own
        cls._declared = declared_parameters(cls)

    @classmethod
    def _is_final(cls) -> bool:
        return not inspect.isabstract(cls) and ABC not in cls.__bases__

    def __post_init__(self) -> None:
        for declared in self.declared():
            value = getattr(self, declared.attribute)
            number = declared.checked(type(self).__name__, value)
            if isinstance(value, float) or not declared.structural:  # a structural fraction stays exact
                object.__setattr__(self, declared.attribute, number)

    def __setattr__(self, name: str, value: Any) -> None:
        raise dataclasses.FrozenInstanceError(f"{type(self).__name__}: {name} cannot be set; use replace(...).")

    def __delattr__(self, name: str) -> None:
        raise dataclasses.FrozenInstanceError(f"{type(self).__name__}: {name} cannot be deleted.")

    def declared(self) -> tuple[Parameter, ...]:
        """Parameters of this part, in order."""
        return self._declared

    @property
    def parameters(self) -> dict[str, Any]:
        """Parameter values by name."""
        return {declared.name: self._value(declared) for declared in self.declared()}

    def _value(self, declared: Parameter) -> Any:
        return getattr(self, declared.attribute)

    def __repr__(self) -> str:
        values = ", ".join(f"{name}={value!r}" for name, value in self.parameters.items())
        return f"{type(self).__name__}({values})"

    def replace(self, **changes: Any) -> Self:
        """Return a copy with some parameters changed, checked like new ones."""
        known = self.parameters
        for name in changes:
            if name not in known:
                raise ParameterError(
                    f"{type(self).__name__} has no parameter {name!r}; it has {', '.join(known) or 'none'}."
                )
        return type(self)(**(known | changes))

    def twin(self, values: Mapping[str, Any]) -> Self:
        """Return an unchecked copy whose parameters are `values` by name, SymPy symbols as a rule.

        The formula method, called on the twin, returns the formula as a SymPy expression.
        """
        twin = object.__new__(type(self))
        for declared in self.declared():
            object.__setattr__(twin, declared.attribute, values[declared.name])
        return twin
