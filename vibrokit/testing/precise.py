"""Formulas and finite differences at sixty digits, as references for derivatives and compiled code."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import mpmath
import sympy

from vibrokit.testing.report import ConformanceError

DIGITS = 60
CLOSE = 1e-12
_STEP = mpmath.mpf("1e-10")  # relative; errors of a central difference: its square, and rounding, 1e-60 divided by it
_EPSILON = 2.0**-52
_ROUNDINGS = 64  # allowed per operation of a formula
_FUNCTIONS = {"Max": max, "Min": min, "Abs": abs, "sign": mpmath.sign}

Function = Callable[..., Any]


def function(formula: sympy.Expr, arguments: Sequence[sympy.Symbol], values: Mapping[sympy.Symbol, float]) -> Function:
    """Return a formula as a function of numbers, evaluated at sixty digits.

    Parameters
    ----------
    formula : Expr
    arguments : sequence of Symbol
    values : mapping of Symbol to float
        Values of the parameters.

    Returns
    -------
    callable
        Returns an mpmath number, and raises ConformanceError where the formula has no finite real value.
    """
    raw = sympy.lambdify([*arguments, *values], formula, modules=[_FUNCTIONS, "mpmath"])

    def evaluated(*point: Any, digits: int = DIGITS) -> Any:
        with mpmath.workdps(digits):
            try:
                value = mpmath.mpmathify(raw(*map(mpmath.mpf, point), *map(mpmath.mpf, values.values())))
            except (ArithmeticError, ValueError):
                value = mpmath.nan
            except (NameError, TypeError, AttributeError) as error:
                problem = f"{type(error).__name__}: {error}"
                raise ConformanceError(f"The formula {formula} cannot be evaluated ({problem}).") from error
            if not (mpmath.isfinite(value) and mpmath.im(value) == 0):
                place = ", ".join(f"{a} = {mpmath.nstr(p, 6)}" for a, p in zip(arguments, point, strict=True))
                shown = {str(symbol): number for symbol, number in values.items()}
                raise ConformanceError(
                    f"The formula {formula} must be finite and real, got {mpmath.nstr(value, 6)} at {place} with "
                    f"{shown}."
                )
            return mpmath.re(value)

    return evaluated


def difference(of: Function, point: Sequence[float], orders: Sequence[int], sizes: Sequence[float]) -> Any:
    """Return a partial derivative by central differences.

    Parameters
    ----------
    of : callable
    point : sequence of float
    orders : sequence of int
        Order of differentiation in each argument, 0 to 2.
    sizes : sequence of float
        Scale of each argument; steps are 1e-10 times it.
    """
    with mpmath.workdps(DIGITS):
        weights: list[tuple[Any, list[Any]]] = [(mpmath.mpf(1), [])]
        for place, order, size in zip(point, orders, sizes, strict=True):
            h, x = _STEP * mpmath.mpf(size), mpmath.mpf(place)
            stencil = {
                0: [(1, x)],
                1: [(1 / (2 * h), x + h), (-1 / (2 * h), x - h)],
                2: [(1 / h**2, x + h), (-2 / h**2, x), (1 / h**2, x - h)],
            }[order]
            weights = [(w * v, [*at, y]) for w, at in weights for v, y in stencil]
        return mpmath.fsum(w * of(*at) for w, at in weights)


def rounding(formula: sympy.Expr) -> sympy.Expr:
    """Return a first-order bound on the error of evaluating a formula in double precision, as a formula.

    Every operation rounds and propagates the errors of its operands, so cancellation is included.
    """
    return sympy.Float(_ROUNDINGS * _EPSILON) * _in_roundings(formula)


def _in_roundings(node: sympy.Expr) -> sympy.Expr:
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
