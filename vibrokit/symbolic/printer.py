"""Prints expressions as Python text that Numba compiles to fast code."""

from __future__ import annotations

import sympy
from sympy.printing.pycode import PythonCodePrinter

_LARGEST_PRODUCT = 16


class SourcePrinter(PythonCodePrinter):  # type: ignore[misc]
    """Python printer that writes powers so that loops over lanes can be vectorised.

    Whole powers become products and half-integer ones products with a square root: a call of ``pow`` would keep
    the loop scalar and cost eight times as much.
    """

    def __init__(self) -> None:
        super().__init__({"fully_qualified_modules": False, "allow_unknown_functions": False})

    def _print_Float(self, expression: sympy.Float) -> str:
        return repr(float(expression))

    def _print_Integer(self, expression: sympy.Integer) -> str:
        return f"{int(expression)}.0"

    def _print_Rational(self, expression: sympy.Rational) -> str:
        numerator, denominator = int(expression.p), int(expression.q)
        if denominator & (denominator - 1) == 0:
            return repr(numerator / denominator)
        return f"({numerator}.0/{denominator}.0)"

    def _print_NumberSymbol(self, expression: sympy.NumberSymbol) -> str:
        return repr(float(expression))

    def _print_Pow(self, expression: sympy.Pow, rational: bool = False) -> str:
        base, exponent = expression.args
        if exponent.is_Rational and exponent.q in (1, 2) and abs(exponent) <= _LARGEST_PRODUCT:
            return self._product(base, exponent)
        return f"({self._print(base)})**({self._print(exponent)})"

    def _product(self, base: sympy.Expr, exponent: sympy.Rational) -> str:
        factor = f"({self._print(base)})" if not base.is_Symbol else self._print(base)
        whole, root = divmod(abs(exponent), 1)
        factors = [factor] * int(whole) + [f"sqrt({self._print(base)})"] * (root != 0)
        product = "*".join(factors)
        if exponent < 0:
            return f"(1.0/({product}))"
        return product if len(factors) == 1 and root else f"({product})"

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


def printable(expression: sympy.Expr) -> sympy.Expr:
    """Rewrite what differentiation leaves behind and no compiler knows: steps and spikes at kinks."""
    expression = expression.replace(sympy.DiracDelta, lambda *arguments: sympy.Integer(0))
    return expression.replace(sympy.Heaviside, lambda argument, *rest: sympy.Piecewise((1, argument > 0), (0, True)))


def assignments(
    targets: dict[str, sympy.Expr], temporary: str, indent: str = "    "
) -> tuple[list[str], dict[str, str]]:
    """Print expressions with their common parts taken out.

    Returns
    -------
    lines : list of str
        Assignments of the common parts, to names made of an underscore, `temporary` and a number.
    texts : dict of str
        Text of each target in terms of these.
    """
    printer = SourcePrinter()
    names = (sympy.Symbol(f"_{temporary}{index}") for index in range(10**6))  # no parameter begins with "_"
    shared, reduced = sympy.cse([printable(e) for e in targets.values()], symbols=names, optimizations=None)
    lines = [f"{indent}{name} = {printer.doprint(value)}" for name, value in shared]
    texts = {name: printer.doprint(value) for name, value in zip(targets, reduced, strict=True)}
    return lines, texts
