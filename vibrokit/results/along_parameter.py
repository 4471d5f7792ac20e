"""AlongParameter: what all records along values of one parameter have."""

from __future__ import annotations

from abc import ABC
from typing import Any

from vibrokit.results.arrays import Arrays
from vibrokit.results.record import Record
from vibrokit.text_units import size_of

_GREEK = (
    "alpha", "beta", "gamma", "delta", "epsilon", "zeta", "eta", "theta", "kappa", "lambda",
    "mu", "nu", "xi", "rho", "sigma", "tau", "phi", "chi", "psi", "omega",
)  # fmt: skip
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
        """Label of the parameter's axis, with symbol and unit in TeX."""
        head, _, index = self.symbol.partition("_")
        letter = f"\\{head}" if head in _GREEK else head
        label = f"{self.parameter} ${letter}{f'_{{{index}}}' if index else ''}$"
        return f"{label} ({_unit_in_tex(self.unit)})" if self.unit else label

    def axis(self, unit: str | None = None) -> tuple[str, float]:
        """Return the label of the parameter's axis in a unit, and the size of that unit in SI.

        Raises
        ------
        ParameterError
            The parameter cannot be shown in this unit.
        """
        if unit is None:
            return self.axis_label, 1.0
        scale = size_of(unit, self.unit)
        return f"{self.parameter} ({unit})", scale

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


def _unit_in_tex(unit: str) -> str:
    words = []
    for word in unit.split():
        base, _, power = word.partition("^")
        words.append(f"{base}$^{{{power}}}$" if power else base)
    return " ".join(words)
