"""Derivatives of formulas, compared with finite differences, and compiled values, compared with formulas."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import mpmath
import sympy

from vibrokit.symbolic.printer import printable
from vibrokit.testing.precise import CLOSE, Function, difference, function, relative_distance, rounding
from vibrokit.testing.report import ConformanceError

ORDERS = ((1, 0), (0, 1), (2, 0), (1, 1), (0, 2))  # that kernels use, in the two arguments of a formula
_NEGLIGIBLE = 1e-18  # relative to the scale of a derivative: the error of a finite difference


def derivative(formula: sympy.Expr, arguments: Sequence[sympy.Symbol], orders: Sequence[int]) -> sympy.Expr:
    """Return a derivative in the form that is printed into kernels."""
    derived = printable(sympy.diff(formula, *zip(arguments, orders, strict=True)))
    if derived.has(sympy.Derivative, sympy.Subs):
        raise ConformanceError(
            f"SymPy cannot differentiate {formula}, it returns {derived}; use functions that have derivatives."
        )
    return derived


def check_derivatives(
    subject: Any,
    value: Function,
    derived: Iterable[tuple[tuple[int, int], Function]],
    points: Sequence[tuple[float, ...]],
) -> float:
    """Compare derivatives with central differences of the formula; return the largest relative distance."""
    worst = 0.0
    for orders, exact in derived:
        for point in points:
            sizes = [abs(coordinate) for coordinate in point]
            scale = abs(value(*point))
            for order, size in zip(orders, sizes, strict=True):
                scale /= mpmath.mpf(size) ** order
            by_formula, by_difference = exact(*point), difference(value, point, orders, sizes)
            if max(abs(by_formula), abs(by_difference)) <= _NEGLIGIBLE * scale:
                continue
            distance = relative_distance(by_formula, by_difference)
            worst = max(worst, distance)
            if distance > CLOSE:
                raise ConformanceError(
                    f"The derivative of orders {orders} of {subject!r} at {point} is {mpmath.nstr(by_formula, 15)} by "
                    f"its formula, but {mpmath.nstr(by_difference, 15)} by finite differences."
                )
    return worst


class Reference:
    """A formula at sixty digits, and the rounding error that double precision may add to it.

    Parameters
    ----------
    formula : Expr
    arguments : sequence of Symbol
    values : mapping of Symbol to float
    """

    def __init__(
        self, formula: sympy.Expr, arguments: Sequence[sympy.Symbol], values: Mapping[sympy.Symbol, float]
    ) -> None:
        self.exact = function(formula, arguments, values)
        self.bound = function(rounding(formula), arguments, values)

    def compare(self, point: Sequence[float], found: Any, factor: int = 1) -> tuple[float, bool]:
        """Return the relative distance of a value from `factor` times the formula, and whether it is acceptable."""
        expected = factor * self.exact(*point)
        distance = relative_distance(found, expected)
        return distance, distance <= CLOSE or abs(mpmath.mpf(found) - expected) <= self.bound(*point)

    def check(self, what: str, point: Sequence[float], found: Any, factor: int = 1) -> float:
        """Compare a compiled value; return its relative distance, or raise ConformanceError."""
        distance, accepted = self.compare(point, float(found), factor)
        if not accepted:
            expected = mpmath.nstr(factor * self.exact(*point), 17)
            place = tuple(map(float, point))
            raise ConformanceError(f"Compiled, {what} is {float(found)!r} at {place}; its formula gives {expected}.")
        return distance
