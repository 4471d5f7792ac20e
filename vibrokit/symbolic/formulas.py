"""The formula of a part: its method is called on a twin with symbols, and the result is checked."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Any

import sympy

from vibrokit.errors import DerivationError

_LARGEST_DENOMINATOR = 64


def derived_formula(
    part: Any, method: str, values: Mapping[str, sympy.Expr], arguments: tuple[sympy.Symbol, ...]
) -> sympy.Expr:
    """Return what a formula method of `part` gives for `arguments` and the symbols `values` of its numeric parameters.

    Structural parameters keep their values. DerivationError is raised if the method fails for symbols, or the result is
    not an expression in the given symbols.
    """
    named = {d.name: values.get(d.name, exact(part.parameters[d.name])) for d in part.declared()}
    title = f"{type(part).__name__}.{method}"
    try:
        answer = sympy.sympify(getattr(part.twin(named), method)(*arguments), strict=True)
    except Exception as error:
        raise DerivationError(
            f"{title} failed when called with symbols ({type(error).__name__}: {error}); use arithmetic and functions "
            "of vibrokit.parts.functions or SymPy, without branches on values."
        ) from error
    if not isinstance(answer, sympy.Expr):
        raise DerivationError(f"{title} must return a SymPy expression, got {answer!r}.")
    strange = answer.free_symbols - set(arguments) - {s for s in values.values() if isinstance(s, sympy.Symbol)}
    if strange:
        raise DerivationError(
            f"{title} uses {', '.join(sorted(map(str, strange)))}, neither an argument nor a parameter; declare it as "
            "a field with parameter(...)."
        )
    return answer.replace(  # floating-point exponents, as in depth**1.5
        lambda node: isinstance(node, sympy.Pow) and isinstance(node.exp, sympy.Float),
        lambda power: sympy.Pow(power.base, exact(float(power.exp))),
    )


def exact(value: Any) -> Any:
    """Return a float such as 1.5, with a denominator of at most 64, as an exact fraction."""
    if isinstance(value, float):
        fraction = Fraction(value)
        if fraction.denominator <= _LARGEST_DENOMINATOR:
            return sympy.Rational(fraction.numerator, fraction.denominator)
        return sympy.Float(value, 17)
    return value
