"""Borders: where a formula ends, at its poles and at the edge of its domain. Found from the expression.

Motion cannot go on across a border. A border is given by a gauge, an expression that is 0 there.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Iterable, Iterator

import sympy

_RATIOS = {
    sympy.tan: lambda u: sympy.sin(u) / sympy.cos(u),
    sympy.cot: lambda u: sympy.cos(u) / sympy.sin(u),
    sympy.sec: lambda u: 1 / sympy.cos(u),
    sympy.csc: lambda u: 1 / sympy.sin(u),
}
_BOUNDED = (sympy.sin, sympy.cos, sympy.tanh, sympy.sign)
_WITHIN_ONE = (sympy.asin, sympy.acos, sympy.atanh)
_WITH_ITS_ZEROS = (sympy.Abs, sympy.sinh, sympy.tanh, sympy.asin, sympy.atan, sympy.asinh, sympy.sign)


@dataclasses.dataclass(frozen=True)
class Border:
    """A border of a formula.

    Attributes
    ----------
    gauge : sympy.Expr
        It is 0 at the border, and keeps its sign while the motion stays on one side.
    pole : bool
        Whether the formula has values on both sides, so that only the sign of the gauge tells them apart. Otherwise
        the gauge is positive where the formula has values.
    """

    gauge: sympy.Expr
    pole: bool

    @property
    def relation(self) -> str:
        """How the gauge compares with 0 where the formula has a value: "≠" or ">"."""
        return "≠" if self.pole else ">"

    def in_words(self, gauge: str) -> str:
        """Return what the border is, with the text of its gauge."""
        return f"a pole of the forces ({gauge} = 0)" if self.pole else f"where the forces end ({gauge} > 0 inside)"

    def at(self, values: dict[sympy.Symbol, sympy.Expr]) -> Border:
        """Return the border with values in place of symbols."""
        return dataclasses.replace(self, gauge=self.gauge.subs(values, simultaneous=True))

    def excludes(self, values: dict[sympy.Symbol, float]) -> bool:
        """Return whether the formula has no value at a place, so far as this border tells."""
        gauge = self.gauge.subs(values, simultaneous=True)
        return bool(gauge.is_zero) if self.pole else not gauge.is_positive

    @property
    def exists(self) -> bool:
        """Whether the gauge may change its sign, as far as SymPy can tell."""
        return not (self.gauge.is_number or self.gauge.is_nonnegative or self.gauge.is_nonpositive) and _has_roots(
            self.gauge
        )


@functools.lru_cache(maxsize=256)  # the same for all values of parameters
def borders_of(expression: sympy.Expr, variables: tuple[sympy.Symbol, ...]) -> tuple[Border, ...]:
    """Return the borders of an expression in some variables; other symbols stand for numbers.

    A singularity where the expression has a limit, as that of sin(x)/x, is no border, and neither is one that SymPy
    knows to be nowhere, as that of 1/(1 + x²).
    """
    for function, ratio in _RATIOS.items():
        expression = expression.replace(function, ratio)
    found: dict[Border, None] = {}
    for node in sympy.preorder_traversal(expression):
        for border in _borders_at(node):
            kept = _without_removable(border, expression, node, variables) if border.pole else border
            if not kept.gauge.free_symbols.isdisjoint(variables) and kept.exists:
                found[kept] = None
    return tuple(found)


def _borders_at(node: sympy.Basic) -> Iterator[Border]:
    """The borders of one operation."""
    if isinstance(node, sympy.Pow) and node.exp.is_number and not node.exp.is_nonnegative:
        whole = node.exp.is_integer
        yield from _poles(node.base) if whole or node.base.is_nonnegative else [Border(node.base, pole=False)]
    elif isinstance(node, sympy.Pow) and node.exp.is_number and not node.exp.is_integer:
        yield Border(node.base, pole=False)
    elif isinstance(node, sympy.log):
        yield from _poles(node.args[0]) if node.args[0].is_nonnegative else [Border(node.args[0], pole=False)]
    elif isinstance(node, _WITHIN_ONE):
        yield from (Border(1 - node.args[0], pole=False), Border(1 + node.args[0], pole=False))
    elif isinstance(node, sympy.acosh):
        yield Border(node.args[0] - 1, pole=False)


def _poles(divisor: sympy.Expr) -> Iterator[Border]:
    """The zeros of a divisor, one border for each factor: a double zero does not change the sign of a product."""
    if isinstance(divisor, _WITH_ITS_ZEROS):
        yield from _poles(divisor.args[0])
    elif divisor.is_Pow and divisor.exp.is_positive:
        yield from _poles(divisor.base)
    elif divisor.is_Mul:
        for factor in divisor.args:
            yield from _poles(factor)
    elif not isinstance(divisor, sympy.exp | sympy.cosh):
        numerator = sympy.fraction(sympy.together(divisor))[0] if divisor.is_Add else divisor
        try:
            factors = sympy.factor_list(numerator)[1]
        except sympy.PolynomialError:
            factors = [(numerator, 1)]
        if len(factors) == 1 and factors[0][1] == 1:  # as it was written
            yield Border(divisor, pole=True)
        else:
            for factor, _ in factors:
                yield from _poles(factor)


def _without_removable(
    border: Border, expression: sympy.Expr, node: sympy.Basic, variables: Iterable[sympy.Symbol]
) -> Border:
    """Divide the gauge of a pole by its zero, as far as one can be found, if the expression is bounded there."""
    terms = sympy.Add(*(term for term in sympy.Add.make_args(expression) if term.has(node)))
    for variable in variables:
        slope = sympy.diff(border.gauge, variable)
        place = sympy.Integer(0)
        if variable not in slope.free_symbols and slope != 0:
            place = sympy.simplify(-border.gauge.subs(variable, 0) / slope)
        if border.gauge.subs(variable, place) == 0 and _bounded(terms, variable, place):
            return Border(sympy.cancel(border.gauge / (variable - place)), pole=True)
    return border


def _bounded(terms: sympy.Expr, variable: sympy.Symbol, place: sympy.Expr) -> bool:
    if not terms.subs(variable, place).has(sympy.nan):  # 0/0; others are infinite
        return False
    try:
        limits = [sympy.limit(terms, variable, place, side) for side in "+-"]
    except (NotImplementedError, ValueError, TypeError):
        return False
    return not any(limit.has(sympy.oo, -sympy.oo, sympy.zoo, sympy.nan) for limit in limits)


def _has_roots(gauge: sympy.Expr) -> bool:
    """Whether an expression has real zeros: as far as the numbers of a polynomial, or the bounds of a sine, tell."""
    if len(gauge.free_symbols) == 1 and gauge.is_polynomial(*gauge.free_symbols):
        return bool(sympy.Poly(sympy.nsimplify(gauge, rational=True)).count_roots())
    bounded = gauge.replace(lambda node: isinstance(node, _BOUNDED), lambda node: sympy.AccumBounds(-1, 1))
    return not (isinstance(bounded, sympy.AccumBounds) and (bounded.min > 0 or bounded.max < 0))
