"""Prints equations for people: positive terms come first in sums, the variable in conditions."""

from __future__ import annotations

from typing import Any

import sympy
from sympy.printing.latex import LatexPrinter
from sympy.printing.str import StrPrinter


class _Reading:
    """Order of terms in text and LaTeX: ``x - b`` instead of the ``-b + x`` of SymPy."""

    def _as_ordered_terms(self, expression: sympy.Expr, order: Any = None) -> list[sympy.Expr]:
        terms = super()._as_ordered_terms(expression, order=order)  # type: ignore[misc]
        return sorted(terms, key=lambda term: term.could_extract_minus_sign())

    def _print_Relational(self, expression: Any) -> str:
        if expression.rhs.is_Symbol and str(expression.rhs) == "x":
            expression = expression.reversed
        return super()._print_Relational(expression)  # type: ignore[misc]


class _Text(_Reading, StrPrinter):
    def _print_Piecewise(self, expression: sympy.Piecewise) -> str:
        (value, condition), *others = expression.args
        if condition == sympy.true:
            return self._print(value)
        rest = self._print(sympy.Piecewise(*others, evaluate=False)) if others else "0"
        return f"({self._print(value)} if {self._print(condition)} else {rest})"


class _Latex(_Reading, LatexPrinter):
    pass


def as_text(expression: sympy.Expr) -> str:
    """Return an expression as one line of text, cases as ``(force if x > b else 0)``."""
    return _Text().doprint(expression)


def as_latex(expression: sympy.Expr) -> str:
    """Return an expression as LaTeX."""
    return _Latex().doprint(expression)
