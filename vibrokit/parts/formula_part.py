"""Parts whose formula is text, with constants named by the user."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any, ClassVar, Self

from vibrokit.parts.formula import check_parameter_names, in_exponents, read
from vibrokit.parts.named_constants import NamedConstants
from vibrokit.parts.parameter import Parameter


class FormulaPart(NamedConstants):
    """Base of the custom parts: a formula as text, and named constants that it may use.

    The formula is structural, and so are constants in exponents of what varies: ``k*depth**n``
    with n = 1.5 is treated like ``k*depth**1.5``.
    """

    variables: ClassVar[tuple[str, ...]]
    formula_name: ClassVar[str] = "formula"

    formula: str

    def _read(self, formula: str, constants: Mapping[str, Any]) -> None:
        """Check formula and constants and store them."""
        check_parameter_names(tuple(constants), (*self.variables, "name", "formula", "constants"))
        read(formula, (*self.variables, *constants))
        owner = type(self).__name__
        checked = tuple((name, self._constant(name).checked(owner, value)) for name, value in constants.items())
        object.__setattr__(self, "formula", formula)
        object.__setattr__(self, "constants", checked)

    def _own(self) -> tuple[Parameter, ...]:
        """Parameters that the class declares besides formula and constants."""
        return tuple(declared for declared in super()._own() if declared.attribute != "formula")

    def declared(self) -> tuple[Parameter, ...]:
        """Parameters of this part: its own, the formula (structural), then each constant."""
        formula = Parameter(self.formula_name, "formula", self.formula_name, "", structural=True)
        shaping = in_exponents(self.formula, self.variables)
        constants = (
            dataclasses.replace(self._constant(name), structural=name in shaping) for name, _ in self.constants
        )
        return (*self._own(), formula, *constants)

    def twin(self, values: Mapping[str, Any]) -> Self:
        """Return an unchecked copy whose constants are `values` by name."""
        twin = super().twin(values)
        object.__setattr__(twin, "formula", self.formula)
        return twin

    def _evaluate(self, *arguments: Any) -> Any:
        """The formula as a SymPy expression in the given variables and the constants of this part."""
        from vibrokit.parts.formula_expression import expression

        return expression(self.formula, dict(zip(self.variables, arguments, strict=True)) | dict(self.constants))
