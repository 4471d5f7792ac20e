"""Parts with any number of constants, each a parameter with a name."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Self

from vibrokit.parts.parameter import Parameter


class NamedConstants:
    """Base of parts with named constants, beside the parameters that the class declares.

    Constants are parameters: they must be finite, have symbols, are saved in scene files, and can be changed without
    recompilation.
    """

    constants: tuple[tuple[str, Any], ...]
    _declared: ClassVar[tuple[Parameter, ...]]

    def _own(self) -> tuple[Parameter, ...]:
        """Parameters that the class declares besides the constants."""
        return tuple(declared for declared in self._declared if declared.attribute != "constants")

    def _constant(self, name: str) -> Parameter:
        """Declaration of one constant; without a unit unless a subclass gives it one."""
        return Parameter(name, name, name, None)

    def declared(self) -> tuple[Parameter, ...]:
        """Parameters of this part: its own, then each constant."""
        return (*self._own(), *(self._constant(name) for name, _ in self.constants))

    def _value(self, declared: Parameter) -> Any:
        constants = dict(self.constants)
        return constants[declared.name] if declared.name in constants else getattr(self, declared.attribute)

    def _stored(self) -> dict[str, Any]:
        """What the fields hold, by the name of each parameter."""
        return {declared.name: getattr(self, declared.attribute) for declared in self._own()} | dict(self.constants)

    def twin(self, values: Mapping[str, Any]) -> Self:
        """Return an unchecked copy whose parameters are `values` by name."""
        twin = object.__new__(type(self))
        for declared in self._own():
            object.__setattr__(twin, declared.attribute, values[declared.name])
        object.__setattr__(twin, "constants", tuple((name, values[name]) for name, _ in self.constants))
        return twin
