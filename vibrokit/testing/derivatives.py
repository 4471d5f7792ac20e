"""Checks of derivatives, for every kind of part: against differences, and compiled against derived."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import mpmath
import sympy

from vibrokit.symbolic.printer import printable
from vibrokit.testing.precise import CLOSE, Function, apart, difference
from vibrokit.testing.report import ConformanceError

ORDERS = ((1, 0), (0, 1), (2, 0), (1, 1), (0, 2))  # that kernels use, in the two arguments of a formula
_NOTHING = 1e-18  # of what a derivative could be: a difference's own error


def derivative(formula: sympy.Expr, arguments: Sequence[sympy.Symbol], orders: Sequence[int]) -> sympy.Expr:
    """Return a derivative in the form in which it is printed into kernels."""
    derived = printable(sympy.diff(formula, *zip(arguments, orders, strict=True)))
    if derived.has(sympy.Derivative, sympy.Subs):
        raise ConformanceError(
            f"SymPy cannot differentiate {formula}: it comes to {derived}; write the formula with functions that have "
            "derivatives."
        )
    return derived


def check_derivatives(
    subject: Any,
    value: Function,
    derived: Iterable[tuple[tuple[int, int], Function]],
    points: Sequence[tuple[float, ...]],
) -> float:
    """Hold derivatives against central differences of the formula itself; return the largest relative distance."""
    worst = 0.0
    for orders, exact in derived:
        for point in points:
            sizes = [abs(coordinate) for coordinate in point]
            scale = abs(value(*point))
            for order, size in zip(orders, sizes, strict=True):
                scale /= mpmath.mpf(size) ** order
            by_formula, by_difference = exact(*point), difference(value, point, orders, sizes)
            distance = apart(by_formula, by_difference)
            if abs(by_formula) <= _NOTHING * scale and abs(by_difference) <= _NOTHING * scale:
                continue
            worst = max(worst, distance)
            if distance > CLOSE:
                raise ConformanceError(
                    f"The derivative of orders {orders} of {subject!r} is {mpmath.nstr(by_formula, 15)} at {point} by "
                    f"its formula but {mpmath.nstr(by_difference, 15)} by differences of the force itself."
                )
    return worst


def check_compiled(subject: Any, what: str, point: Any, found: float, exact: Any, bound: Any) -> float:
    """Hold one compiled number against the derived one; return their relative distance."""
    distance = apart(found, exact)
    if distance > CLOSE and not abs(mpmath.mpf(found) - exact) <= bound:
        raise ConformanceError(
            f"Compiled, {what} of {subject!r} is {found!r} at {point}; its formula gives {mpmath.nstr(exact, 17)}."
        )
    return distance
