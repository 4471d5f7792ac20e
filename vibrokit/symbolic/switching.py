"""Places where a formula switches, and its one-sided values there, for any values of its parameters."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import mpmath
import numpy as np
import sympy

from vibrokit.parts.part import Part

_DECADES = 6.0  # their sizes are 10^±6; so are the velocities between which a switch is sought
_GRID = sorted(
    mpmath.mpf(sign * 10.0 ** (step / 4)) for sign in (-1, 0, 1) for step in range(-24, 25) if sign or not step
)
DIGITS = 60
"""Of the arithmetic."""
NEAR, NEARER = mpmath.mpf("1e-10"), mpmath.mpf("1e-20")
"""Distances from a switch, relative to its place; continuous functions differ across the two."""

_SWITCHES = (
    sympy.sign, sympy.Heaviside, sympy.floor, sympy.ceiling, sympy.frac, sympy.Mod, sympy.acot, sympy.atan2,
)  # fmt: skip

Function = Callable[..., Any]


class Slice:
    """A formula of a part as a function of one variable, at any values of the others and of the parameters.

    Parameters
    ----------
    part : Part
    formula : sympy.Expr
    variable : sympy.Symbol
    values : mapping
        The symbol of each parameter of the part.
    """

    def __init__(
        self, part: Part, formula: sympy.Expr, variable: sympy.Symbol, values: Mapping[str, sympy.Expr]
    ) -> None:
        self.names = {symbol: name for name, symbol in values.items() if symbol in formula.free_symbols}
        self._numbers = {symbol: float(part.parameters[name]) for symbol, name in self.names.items()}
        self._others = sorted(formula.free_symbols - {variable}, key=str)
        self._exponents = set().union(*(power.exp.free_symbols for power in formula.atoms(sympy.Pow)))
        self._variable = variable
        self.value = self.function_of(formula)

    def function_of(self, expression: sympy.Expr) -> Function:
        """Return an expression as a function of the variable and a point."""
        return sympy.lambdify([self._variable, *self._others], expression, "mpmath", dummify=True)

    def points(self, count: int, *, own: bool = False) -> Iterator[list[mpmath.mpf]]:
        """Draw values of all symbols but the variable.

        Parameters in exponents and, at first or with `own`, all others keep the values of the scene: the same compiled
        code serves other values.
        """
        rng = np.random.default_rng(0)
        for draw in range(count):
            point = []
            for symbol in self._others:
                size = 10.0 ** rng.uniform(-_DECADES, _DECADES)
                sign = 1.0 if symbol.is_nonnegative else -1.0 if symbol.is_negative else rng.choice([-1.0, 1.0])
                drawn = float(size * sign)
                kept = symbol in self._numbers and (own or draw == 0 or symbol in self._exponents)
                point.append(mpmath.mpf(self._numbers[symbol] if kept else drawn))
            yield point


def switches_of(force: sympy.Expr, speed: sympy.Symbol) -> list[sympy.Expr]:
    """Expressions at whose zeros the force may jump in the speed."""
    found: list[sympy.Expr] = []
    for node in sympy.preorder_traversal(force):
        if isinstance(node, sympy.Mod):
            found += [node.args[0] / node.args[1]]
        elif isinstance(node, _SWITCHES):
            found += node.args
        elif isinstance(node, sympy.core.relational.Relational):
            found.append(node.lhs - node.rhs)
        elif isinstance(node, sympy.tan | sympy.sec):  # an arc tangent makes a jump of a pole
            found.append(sympy.cos(node.args[0]))
        elif isinstance(node, sympy.cot | sympy.csc):
            found.append(sympy.sin(node.args[0]))
        elif isinstance(node, sympy.Pow) and node.exp.is_nonnegative is not True:
            found.append(node.base.args[0] if isinstance(node.base, sympy.Abs) else node.base)
        if isinstance(node, sympy.floor | sympy.ceiling | sympy.frac | sympy.Mod):  # at 0 a factor may hide the jump
            found.append(found[-1] - 1)
    return [each for each in dict.fromkeys(found) if speed in each.free_symbols]


def zeros_of(argument: Callable[[Any], mpmath.mpf]) -> Iterator[mpmath.mpf]:
    """Where an argument changes its sign or is zero: exactly if it is linear, else as far as a grid shows it."""
    zero, one, two = (argument(mpmath.mpf(number)) for number in range(3))
    if one != zero and abs(two - 2 * one + zero) < NEARER**2 * abs(one - zero):
        yield zero / (zero - one)
        return
    signs = [mpmath.sign(argument(place)) for place in _GRID]
    yield from (place for place, sign in zip(_GRID, signs, strict=True) if sign == 0)
    for (low, high), (before, after) in zip(itertools.pairwise(_GRID), itertools.pairwise(signs), strict=True):
        if before * after < 0:
            yield _bisected(argument, low, high, before)


def _bisected(argument: Callable[[Any], mpmath.mpf], low: mpmath.mpf, high: mpmath.mpf, sign: Any) -> mpmath.mpf:
    while abs(high - low) > NEARER**2 * max(abs(low), abs(high)):
        middle = (low + high) / 2
        if mpmath.sign(argument(middle)) == sign:
            low = middle
        else:
            high = middle
    return (low + high) / 2


def real_value(function: Function, speed: mpmath.mpf, point: list[mpmath.mpf]) -> mpmath.mpf:
    """Value of a function, NaN where it has no real one."""
    try:
        return mpmath.mpf(function(speed, *point))
    except (ArithmeticError, TypeError, ValueError):
        return mpmath.nan
