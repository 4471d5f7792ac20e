"""Places where a formula switches, and its values beside them, for any values of its parameters."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import mpmath
import numpy as np
import sympy

_DRAWS = 40  # of the other variables and parameters
_DECADES = 6.0  # their sizes are 10^±6; so are the velocities between which a switch is sought
_GRID = sorted(
    mpmath.mpf(sign * 10.0 ** (step / 4)) for sign in (-1, 0, 1) for step in range(-24, 25) if sign or not step
)
DIGITS = 60
"""Of the arithmetic."""
NEAR, NEARER = mpmath.mpf("1e-10"), mpmath.mpf("1e-20")
"""Distances from a switch, relative to its place; continuous functions differ across the two."""

Function = Callable[..., Any]


def points_of(
    others: list[sympy.Symbol], numbers: Mapping[sympy.Symbol, float], fixed: set[sympy.Symbol], count: int = _DRAWS
) -> Iterator[list[mpmath.mpf]]:
    """Values of all symbols but the speed: the parameters `fixed` and, at first, all keep those of the scene."""
    rng = np.random.default_rng(0)
    for draw in range(count):
        point = []
        for symbol in others:
            size = 10.0 ** rng.uniform(-_DECADES, _DECADES)
            sign = 1.0 if symbol.is_nonnegative else -1.0 if symbol.is_negative else rng.choice([-1.0, 1.0])
            drawn = size * sign
            kept = symbol in fixed or (draw == 0 and symbol in numbers)
            point.append(mpmath.mpf(numbers[symbol] if kept else float(drawn)))
        yield point


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
