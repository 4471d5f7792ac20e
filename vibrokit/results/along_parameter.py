"""AlongParameter: what all records along values of one parameter have."""

from __future__ import annotations

from abc import ABC
from typing import Any

from vibrokit.results.arrays import Arrays
from vibrokit.results.record import Record
from vibrokit.text_units import parameter_text, size_of

_TEXTS = ("parameter", "symbol", "unit")


class AlongParameter(Record, ABC):
    """What was found along values of one parameter. Abstract.

    Attributes
    ----------
    parameter : str
        Path of the parameter, as in ``osc.parameters``.
    symbol : str
        Its letter, as SymPy writes it.
    unit : str or None
        In SI base units.
    """

    parameter: str
    symbol: str
    unit: str | None

    @property
    def axis_label(self) -> str:
        """Label of the parameter's axis, with symbol and unit."""
        return parameter_text(self.parameter, self.symbol, self.unit)

    def axis(self, unit: str | None = None) -> tuple[str, float]:
        """Return the label of the parameter's axis in a unit, and the size of that unit in SI.

        Raises
        ------
        ParameterError
            The parameter cannot be shown in this unit.
        """
        if unit is None:
            return self.axis_label, 1.0
        return parameter_text(self.parameter, self.symbol, unit), size_of(unit, self.unit)

    def parameter_variables(self) -> dict[str, Any]:
        """Return the arrays that hold the parameter."""
        return {
            "parameter": ((), self.parameter, {"long_name": "path of the parameter"}),
            "symbol": ((), self.symbol, {"long_name": "symbol of the parameter"}),
            "unit": ((), self.unit or "", {"long_name": "unit of the parameter"}),
        }

    @staticmethod
    def read_parameter(arrays: Arrays) -> dict[str, Any]:
        """Return the parameter of some arrays, by attribute; raises ResultFileError."""
        parameter, symbol, unit = (arrays.words(name, ())[0] for name in _TEXTS)
        return {"parameter": parameter, "symbol": symbol, "unit": unit or None}
