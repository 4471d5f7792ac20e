"""Prints expressions: as Python text that Numba compiles to fast code, and as text and LaTeX for people."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import sympy
from sympy.printing.latex import LatexPrinter
from sympy.printing.pycode import PythonCodePrinter
from sympy.printing.str import StrPrinter

from vibrokit.symbolic.symbols import Named, code_name

_LARGEST_PRODUCT = 16

FUNCTIONS = frozenset(
    (
        sympy.acos, sympy.acosh, sympy.asin, sympy.asinh, sympy.atan, sympy.atan2, sympy.atanh, sympy.cos, sympy.cosh,
        sympy.cot, sympy.csc, sympy.erf, sympy.erfc, sympy.exp, sympy.log, sympy.sec, sympy.sin, sympy.sinh, sympy.tan,
        sympy.tanh, sympy.Abs, sympy.sign, sympy.Heaviside, sympy.Mod, sympy.Piecewise,
    )
)  # fmt: skip
"""What compiled code can call, besides roots, the least and the largest of several numbers."""


class SourcePrinter(PythonCodePrinter):
    """Python printer for loops over lanes that the compiler can vectorise.

    Integer powers become products, and half-integer powers products with a square root: a call to ``pow`` prevents
    vectorisation and costs eight times as much. The compiler keeps the order of sums and products, so square roots
    and the symbols whose values arrive last are written last, and other operations need not wait for them: `arrival`
    has the position of symbols in the order in which their values become known, 0 for the others.
    """

    def __init__(self, arrival: Mapping[sympy.Symbol, int] | None = None) -> None:
        super().__init__({"fully_qualified_modules": False, "allow_unknown_functions": False})
        self._arrival = arrival or {}

    def _as_ordered_terms(self, expression: sympy.Expr, order: str | None = None) -> list[sympy.Expr]:
        terms = super()._as_ordered_terms(expression, order=order)
        return sorted(terms, key=lambda term: max((self._arrival.get(s, 0) for s in term.free_symbols), default=0))

    def _print_Mul(self, expression: sympy.Mul) -> str:
        roots = [factor for factor in expression.args if _is_root(factor)]
        if not roots:
            return str(super()._print_Mul(expression))
        others = sympy.Mul(*(factor for factor in expression.args if factor not in roots))
        product = "*".join("*".join(self._factors(*root.args)) for root in roots)
        if abs(others) == 1:
            return f"-{product}" if others == -1 else product
        text = self._print(others)
        return f"({text})*{product}" if others.is_Add else f"{text}*{product}"

    def _print_Named(self, expression: Named) -> str:
        return code_name(expression)

    def _print_Integer(self, expression: sympy.Integer) -> str:
        return f"{int(expression)}.0"

    def _print_Rational(self, expression: sympy.Rational) -> str:
        numerator, denominator = int(expression.p), int(expression.q)
        if denominator & (denominator - 1) == 0:
            return repr(numerator / denominator)
        return f"({numerator}.0/{denominator}.0)"

    def _print_number(self, expression: sympy.Expr) -> str:
        return repr(float(expression))

    _print_Float = _print_NumberSymbol = _print_Pi = _print_Exp1 = _print_number

    def _print_Pow(self, expression: sympy.Pow, rational: bool = False) -> str:
        base, exponent = expression.args
        if exponent.is_Rational and exponent.q in (1, 2) and abs(exponent) <= _LARGEST_PRODUCT:
            product = "*".join(self._factors(base, exponent))
            if exponent < 0:
                return f"(1.0/({product}))"
            return product if exponent == sympy.S.Half else f"({product})"
        return f"({self._print(base)})**({self._print(exponent)})"

    def _factors(self, base: sympy.Expr, exponent: sympy.Rational) -> list[str]:
        factor = f"({self._print(base)})" if not base.is_Symbol else self._print(base)
        whole, root = divmod(abs(exponent), 1)
        return [factor] * int(whole) + [f"sqrt({self._print(base)})"] * (root != 0)

    def _print_Piecewise(self, expression: sympy.Piecewise) -> str:
        text = "0.0"
        for value, condition in reversed(expression.args):
            if condition == sympy.true:
                text = f"({self._print(value)})"
            else:
                text = f"({self._print(value)} if {self._print(condition)} else {text})"
        return text

    def _print_sign(self, expression: sympy.sign) -> str:
        text = self._print(expression.args[0])
        return f"(1.0 if {text} > 0.0 else (-1.0 if {text} < 0.0 else 0.0))"

    def _print_Max(self, expression: sympy.Max) -> str:
        return self._fold("max", expression)

    def _print_Min(self, expression: sympy.Min) -> str:
        return self._fold("min", expression)

    def _fold(self, name: str, expression: sympy.Expr) -> str:
        text, *others = (self._print(argument) for argument in expression.args)
        for other in others:
            text = f"{name}({text}, {other})"
        return text


def _is_root(factor: sympy.Expr) -> bool:
    exponent = factor.exp if factor.is_Pow else sympy.Integer(0)
    return bool(exponent.is_Rational and exponent.q == 2 and 0 < exponent <= _LARGEST_PRODUCT)


def printable(expression: sympy.Expr) -> sympy.Expr:
    """Replace the step and delta functions that differentiation yields at kinks; compilers do not know them.

    SymPy leaves the derivative of sign(x/a) as it stands, where a might be 0.
    """
    expression = expression.replace(sympy.DiracDelta, lambda *arguments: sympy.Integer(0))
    expression = expression.replace(
        lambda node: isinstance(node, sympy.Derivative) and isinstance(node.expr, sympy.sign),
        lambda node: sympy.Integer(0),
    )
    return expression.replace(sympy.Heaviside, lambda argument, *rest: sympy.Piecewise((1, argument > 0), (0, True)))


def unpack(expressions: Iterable[sympy.Expr], places: Mapping[sympy.Symbol, int], indent: str = "    ") -> list[str]:
    """Assignments of the parameters in some expressions from ``theta``; `places` has the index of each parameter."""
    used = set().union(*(expression.free_symbols for expression in expressions))
    return [f"{indent}{code_name(symbol)} = theta[{place}]" for symbol, place in places.items() if symbol in used]


def assignments(
    targets: dict[str, sympy.Expr],
    temporary: str,
    indent: str = "    ",
    arrival: Mapping[sympy.Symbol, int] | None = None,
) -> tuple[list[str], dict[str, str]]:
    """Print expressions after common subexpression elimination.

    Returns the assignments of the common subexpressions, to names made of an underscore, `temporary` and a number, and
    the text of each target in terms of these names.
    """
    printer = SourcePrinter(arrival)
    names = (sympy.Symbol(f"_{temporary}{index}") for index in range(10**6))
    shared, reduced = sympy.cse([printable(e) for e in targets.values()], symbols=names, optimizations=None)
    lines = [f"{indent}{name} = {printer.doprint(value)}" for name, value in shared]
    texts = {name: printer.doprint(value) for name, value in zip(targets, reduced, strict=True)}
    return lines, texts


class _Reading:
    """Positive terms come first in sums, ``x - b`` for SymPy's ``-b + x``, and the variable in conditions."""

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
