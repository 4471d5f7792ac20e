"""Equations as presentation MathML, which browsers draw without any script."""

from __future__ import annotations

from typing import Any

import sympy
from sympy.printing.mathml import MathMLPresentationPrinter

_ESCAPED = str.maketrans({"<": "&lt;", ">": "&gt;"})  # SymPy writes signs as they are


class _CasesPrinter(MathMLPresentationPrinter):
    """SymPy's printer, with pieces of a function below one another."""

    def mathml_tag(self, expression: Any) -> str:
        return str(super().mathml_tag(expression)).translate(_ESCAPED)

    def _print_Piecewise(self, expression: sympy.Piecewise) -> Any:
        table = self.dom.createElement("mtable")
        for value, condition in expression.args:
            row = self.dom.createElement("mtr")
            reason = self._text("else") if condition == sympy.true else self._print(condition)
            for entry in (self._print(value), reason):
                cell = self.dom.createElement("mtd")
                cell.appendChild(entry)
                row.appendChild(cell)
            table.appendChild(row)
        pieces = self.dom.createElement("mrow")
        brace = self.dom.createElement("mo")
        brace.appendChild(self.dom.createTextNode("{"))
        pieces.appendChild(brace)
        pieces.appendChild(table)
        return pieces

    def _text(self, words: str) -> Any:
        text = self.dom.createElement("mtext")
        text.appendChild(self.dom.createTextNode(words))
        return text


def as_mathml(expression: sympy.Expr) -> str:
    """Return an expression as presentation MathML, without the element ``math`` around it."""
    return str(_CasesPrinter({"mul_symbol": "&#8290;"})._print(expression).toxml())


def rate_equation(variable: sympy.Symbol, rate: sympy.Expr) -> str:
    """Return the equation for the derivative of a variable in time as an element ``math``."""
    left = f"<mover>{as_mathml(variable)}<mo>˙</mo></mover>"
    return f'<math display="block"><mrow>{left}<mo>=</mo>{as_mathml(rate)}</mrow></math>'


def definition(name: str, expression: sympy.Expr) -> str:
    """Return the definition of a quantity as an element ``math``."""
    return f'<math display="block"><mrow><mi>{name}</mi><mo>=</mo>{as_mathml(expression)}</mrow></math>'
