"""Formulas at sixty digits, and differences of them: what derivatives and compiled code are held against."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import mpmath
import sympy

from vibrokit.testing.report import ConformanceError

DIGITS = 60
CLOSE = 1e-12
_STEP = mpmath.mpf("1e-10")  # relative; a central difference errs by its square, rounding by 1e-60 over it
_EPSILON = 2.0**-52
_ROUNDINGS = 64  # of a formula's every operation, that compiled code may add up
_FUNCTIONS = {"Max": max, "Min": min, "Abs": abs, "sign": mpmath.sign}

Function = Callable[..., Any]


def function(formula: sympy.Expr, arguments: Sequence[sympy.Symbol], values: Mapping[sympy.Symbol, float]) -> Function:
    """Return a formula as a function of numbers, evaluated at sixty digits.

    Parameters
    ----------
    formula : Expr
    arguments : sequence of Symbol
    values : mapping of Symbol to float
        Of the parameters.

    Returns
    -------
    callable
        What it returns is an mpmath number; it raises ConformanceError where the formula has no finite real value.
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
                    f"The formula {formula} is {mpmath.nstr(value, 6)} at {place}, with {shown}; it must be finite "
                    "and real."
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
        Times that each argument is differentiated, 0 to 2.
    sizes : sequence of float
        Scale of each argument, of which the steps are 1e-10.
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
    """Return what a double-precision evaluation of a formula may err by, to first order, as a formula again.

    Every operation rounds, and passes on what its operands erred by: cancellation is no mistake of a compiler.
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


def apart(found: Any, exact: Any) -> float:
    """Relative distance of two numbers; 0 where neither is more than 1e-300."""
    if not mpmath.isfinite(found):
        return math.inf
    with mpmath.workdps(DIGITS):
        found = mpmath.mpf(found)
        size = max(abs(exact), abs(found))
        return 0.0 if size < 1e-300 else float(abs(found - exact) / size)
