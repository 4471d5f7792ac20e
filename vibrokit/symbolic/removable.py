"""Removable singularities: divisions that cancel, such as those of (x³ − x)/x and of x/√|x|."""

from __future__ import annotations

from collections.abc import Sequence

import sympy


def without_removable(expression: sympy.Expr, variables: Sequence[sympy.Symbol]) -> sympy.Expr:
    """Return the same function without the divisions by a variable, or by a polynomial in it, that cancel.

    If none cancels, the expression is returned as it was written. A 0/0 such as that of sin(x)/x may remain.
    """
    for variable in variables:
        if variable in _divisors(expression):
            shorter = _by_magnitude(expression, variable)
            expression = shorter if variable not in _divisors(shorter) else expression
    if _divisors(expression).isdisjoint(variables) or not expression.is_rational_function(*variables):
        return expression
    shorter = sympy.cancel(expression)
    return shorter if _degree(shorter, variables) < _degree(expression, variables) else expression


def _degree(expression: sympy.Expr, variables: Sequence[sympy.Symbol]) -> int:
    """Return the degree of the common denominator, as it is written; 0 if that is no polynomial."""
    below = [sympy.fraction(term)[1] for term in sympy.Add.make_args(expression)]
    if not all(one.is_polynomial(*variables) for one in below):
        return 0
    return int(sympy.Poly(sympy.lcm_list(below), *variables).total_degree())


def _divisors(expression: sympy.Expr) -> set[sympy.Symbol]:
    """Return the symbols in bases of negative powers."""
    powers = (power for power in expression.atoms(sympy.Pow) if power.exp.is_negative)
    return set[sympy.Symbol]().union(*(power.base.free_symbols for power in powers))


def _by_magnitude(expression: sympy.Expr, variable: sympy.Symbol) -> sympy.Expr:
    """Collect powers of a variable u and of |u|, as u = s |u| with its sign s, where s² = 1."""
    size, sign = sympy.Symbol("_size", positive=True), sympy.Symbol("_sign", real=True)
    terms = []
    for term in sympy.Add.make_args(expression):
        if not term.has(sympy.Abs(variable)) or variable not in _divisors(term):
            terms.append(term)
            continue
        product = sympy.powsimp(
            sympy.expand_power_base(term.subs(sympy.Abs(variable), size).subs(variable, sign * size))
        )
        turns = product.as_powers_dict().get(sign, 0)
        if not getattr(turns, "is_integer", True):
            return expression
        rest = product / sign**turns
        terms.append(sign ** (turns % 2) * rest)
    back = {size: sympy.Abs(variable), sign: sympy.sign(variable)}
    return sympy.Add(*terms).subs(back)
