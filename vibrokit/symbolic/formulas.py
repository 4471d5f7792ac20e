"""Asks a part for its formula: calls its method on a twin of symbols and checks what comes back."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Any

import sympy

from vibrokit.errors import DerivationError

_LARGEST_DENOMINATOR = 64


def ask(part: Any, method: str, values: Mapping[str, sympy.Expr], arguments: tuple[sympy.Symbol, ...]) -> sympy.Expr:
    """Return the formula of `part` as an expression of `arguments` and its parameters' symbols.

    Parameters
    ----------
    part : Part
    method : str
        Name of the formula method.
    values : mapping
        Symbol of each parameter that is a number; structural ones stay as they are.
    arguments : tuple of Symbol

    Raises
    ------
    DerivationError
        The method failed on symbols, or used a symbol that it was not given.
    """
    named = {d.name: values.get(d.name, exact(part.parameters[d.name])) for d in part.declared()}
    title = f"{type(part).__name__}.{method}"
    try:
        answer = sympy.sympify(getattr(part.twin(named), method)(*arguments), strict=True)
    except Exception as error:
        raise DerivationError(
            f"{title} failed when it was called with symbols ({type(error).__name__}: {error}); write it with "
            "arithmetic and the functions of vibrokit.parts.functions or SymPy, without branches on values."
        ) from error
    if not isinstance(answer, sympy.Expr):
        raise DerivationError(f"{title} returned {answer!r}, which is no expression; return the force as one.")
    strange = answer.free_symbols - set(arguments) - {s for s in values.values() if isinstance(s, sympy.Symbol)}
    if strange:
        raise DerivationError(
            f"{title} uses {', '.join(sorted(map(str, strange)))}, which is neither an argument nor a parameter; "
            "declare it as a field with parameter(...)."
        )
    return with_exact_exponents(answer)


def exact(value: Any) -> Any:
    """Return a number as an exact fraction if it is a simple one, so that exponents such as 1.5 stay exact."""
    if isinstance(value, float):
        fraction = Fraction(value)
        if fraction.denominator <= _LARGEST_DENOMINATOR:
            return sympy.Rational(fraction.numerator, fraction.denominator)
        return sympy.Float(value, 17)
    return value


def with_exact_exponents(expression: sympy.Expr) -> sympy.Expr:
    """Replace exponents that are simple floating-point numbers, as in ``depth**1.5``, by fractions."""

    def is_float_power(node: sympy.Basic) -> bool:
        return isinstance(node, sympy.Pow) and isinstance(node.exp, sympy.Float)

    def exact_power(node: sympy.Basic) -> sympy.Expr:
        base, exponent = node.args
        return sympy.Pow(base, exact(float(exponent)))

    return expression.replace(is_float_power, exact_power)
