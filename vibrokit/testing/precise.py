"""Formulas, derivatives and finite differences at sixty digits, as references for compiled code."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any

import mpmath
import sympy

from vibrokit.symbolic.printer import printable
from vibrokit.testing.report import ConformanceError

DIGITS = 60
CLOSE = 1e-12
_STEP = mpmath.mpf("1e-10")  # relative; errors of a central difference: its square, and rounding, 1e-60 divided by it
_FUNCTIONS = {"Max": max, "Min": min, "Abs": abs, "sign": mpmath.sign}

Function = Callable[..., Any]


def function(formula: sympy.Expr, arguments: Sequence[sympy.Symbol], values: Mapping[sympy.Symbol, float]) -> Function:
    """Return a formula as a function of numbers, evaluated at sixty digits; `values` are those of the parameters.

    It returns an mpmath number, and raises ConformanceError where the formula has no finite real value.
    """
    raw = sympy.lambdify([*arguments, *values], formula, modules=[_FUNCTIONS, "mpmath"], dummify=True)

    def evaluated(*point: Any, digits: int = DIGITS) -> Any:
        with mpmath.workdps(digits):
            try:
                value = mpmath.mpmathify(raw(*map(mpmath.mpf, point), *map(mpmath.mpf, values.values())))
            except (ArithmeticError, ValueError):
                value = mpmath.nan
            if not (mpmath.isfinite(value) and mpmath.im(value) == 0):
                place = ", ".join(f"{a} = {mpmath.nstr(p, 6)}" for a, p in zip(arguments, point, strict=True))
                shown = {str(symbol): number for symbol, number in values.items()}
                raise ConformanceError(
                    f"The formula {formula} must be finite and real, got {mpmath.nstr(value, 6)} at {place} with "
                    f"{shown}."
                )
            return mpmath.re(value)

    return evaluated


def derivative(formula: sympy.Expr, arguments: Sequence[sympy.Symbol], orders: Sequence[int]) -> sympy.Expr:
    """Return a derivative in the form that is printed into kernels."""
    derived = printable(sympy.diff(formula, *zip(arguments, orders, strict=True)))
    if derived.has(sympy.Derivative, sympy.Subs):
        raise ConformanceError(
            f"SymPy cannot differentiate {formula}, it returns {derived}; use functions that have derivatives."
        )
    return derived


def difference(of: Function, point: Sequence[float], orders: Sequence[int]) -> Any:
    """Return a partial derivative of orders 0 to 2 by central differences, with steps of 1e-10 times the argument."""
    with mpmath.workdps(DIGITS):
        weights: list[tuple[Any, list[Any]]] = [(mpmath.mpf(1), [])]
        for place, order in zip(point, orders, strict=True):
            h, x = _STEP * mpmath.mpf(abs(place)), mpmath.mpf(place)
            stencil = {
                0: [(1, x)],
                1: [(1 / (2 * h), x + h), (-1 / (2 * h), x - h)],
                2: [(1 / h**2, x + h), (-2 / h**2, x), (1 / h**2, x - h)],
            }[order]
            weights = [(w * v, [*at, y]) for w, at in weights for v, y in stencil]
        return mpmath.fsum(w * of(*at) for w, at in weights)


def _in_roundings(node: sympy.Expr) -> sympy.Expr:
    """Return a first-order bound on the error of a formula in double precision, in units of one rounding, as a formula.

    Every operation rounds and propagates the errors of its operands, so cancellation is included.
    """
    if node.is_Symbol:
        return sympy.Integer(0)
    if not node.args:
        return abs(node)
    if isinstance(node, sympy.Piecewise):
        return sympy.Piecewise(*((_in_roundings(value), condition) for value, condition in node.args))
    errors = [_in_roundings(argument) for argument in node.args]
    if isinstance(node, sympy.Pow) and node.exp.is_number:
        errors[1] = sympy.Integer(0)
    if isinstance(node, sympy.Max | sympy.Min | sympy.Abs | sympy.sign):
        return abs(node) + sum(errors)
    if isinstance(node, sympy.Add):
        slopes = [sympy.Integer(1)] * len(errors)
    elif isinstance(node, sympy.Mul):
        slopes = [sympy.Mul(*node.args[:i], *node.args[i + 1 :]) for i in range(len(errors))]
    else:
        places = [sympy.Dummy(real=True) for _ in errors]
        back = dict(zip(places, node.args, strict=True))
        slopes = [sympy.diff(node.func(*places), place).xreplace(back) for place in places]
    passed_on = [abs(slope) * error for slope, error in zip(slopes, errors, strict=True) if error != 0]
    return abs(node) + sum(passed_on)


def relative_distance(found: Any, exact: Any) -> float:
    """Relative distance of two numbers; 0 if both are below 1e-300 in size."""
    if not mpmath.isfinite(found):
        return math.inf
    with mpmath.workdps(DIGITS):
        found = mpmath.mpf(found)
        size = max(abs(exact), abs(found))
        return 0.0 if size < 1e-300 else float(abs(found - exact) / size)


class Reference:
    """A formula at sixty digits, and the rounding error that double precision may add to it."""

    def __init__(
        self, formula: sympy.Expr, arguments: Sequence[sympy.Symbol], values: Mapping[sympy.Symbol, float]
    ) -> None:
        self.exact = function(formula, arguments, values)
        self._formula, self._arguments, self._values = formula, arguments, values

    @cached_property
    def bound(self) -> Function:
        """The largest rounding error: 64 roundings for each operation of the formula."""
        allowed = sympy.Float(64 * 2.0**-52) * _in_roundings(self._formula)
        return function(allowed, self._arguments, self._values)

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
