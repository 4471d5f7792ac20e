"""AlongParameter: what all records along values of one parameter have."""

from __future__ import annotations

from abc import ABC
from collections.abc import Mapping
from typing import Annotated, Any

from vibrokit.quantity import size_of, unit_in
from vibrokit.results.arrays import Arrays
from vibrokit.results.fields import Word
from vibrokit.results.record import Record
from vibrokit.results.table import Table
from vibrokit.text_units import parameter_text

_PARAMETER = Table(
    "",
    {
        "parameter": Word("path of the parameter"),
        "symbol": Word("symbol of the parameter"),
        "unit": Word("unit of the parameter"),
    },
)


class AlongParameter(Record, ABC):
    """What was found along values of one parameter. Abstract."""

    parameter: Annotated[str, "path of the parameter, as in ``osc.parameters``; of the first if several are tied"]
    symbol: Annotated[str, "its letter, as SymPy writes it"]
    unit: Annotated[str | None, "its unit in SI base units"]

    @property
    def factors(self) -> dict[str, float]:
        """Each parameter divided by the values, by its path: 1 for a single one, others where several are tied."""
        given = self.settings.get("parameter")
        return dict(given) if isinstance(given, Mapping) else {self.parameter: 1.0}

    @property
    def parameters_text(self) -> str:
        """The parameter, or all that are tied: ``barriers.0.position = −barriers.1.position``."""
        texts = []
        for path, factor in self.factors.items():
            sign, size = "−" * (factor < 0), abs(factor)
            texts.append(f"{sign}{path}" if size == 1 else f"{sign}{path}/{size:g}")
        return " = ".join(texts)

    @property
    def shown_in(self) -> str | None:
        """Unit in which the user gave the values, or the parameter in the scene; None for SI base units."""
        own = self.scene.get("given", {}).get(self.parameter)
        return self.settings.get("unit") or (unit_in(own) if own else None)

    @property
    def length_unit(self) -> tuple[str, float] | None:
        """Unit in which the scene has the position of a stop, and its size (m); None if it has it in SI base units."""
        texts = (text for path, text in self.scene.get("given", {}).items() if path.endswith(".position"))
        unit = next(map(unit_in, texts), None)
        return None if unit is None else (unit, size_of(unit, "m"))

    def axis(self, unit: str | None = None) -> tuple[str, float]:
        """Return the label of the parameter's axis in a unit, and the size of that unit in SI; by default `shown_in`.

        Raises
        ------
        ParameterError
            The parameter cannot be shown in this unit.
        """
        symbol = self.symbol if self.factors == {self.parameter: 1.0} else ""
        shown = unit or self.shown_in
        label = parameter_text(self.parameters_text, symbol, shown or self.unit)
        return label, 1.0 if shown is None else size_of(shown, self.unit, self.scene.get("mass"))

    def parameter_variables(self) -> dict[str, Any]:
        """Return the arrays that hold the parameter."""
        return _PARAMETER.variables([self], unit=[self.unit or ""])

    @staticmethod
    def read_parameter(arrays: Arrays) -> dict[str, Any]:
        """Return the parameter of some arrays, by attribute; raises ResultFileError."""
        (found,) = _PARAMETER.read(arrays)
        return found | {"unit": found["unit"] or None}
