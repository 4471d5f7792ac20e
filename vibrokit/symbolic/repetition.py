"""Forces that repeat along x, such as that of a pendulum."""

from __future__ import annotations

import functools
import math
from fractions import Fraction

import numpy as np
import sympy

from vibrokit.parts.spring import Spring

_LARGEST_RATIO = 64  # of two periods to their common one
_SAME = 1e-9  # relative: two periods, or two forces, that are the same
_PARTS = (2, 3, 5, 7)
_PLACES = 64  # at which forces are compared


@functools.lru_cache(maxsize=256)
def period_along_x(spring: Spring) -> float:
    """Return the least distance (m) along x by which the force of a spring repeats; 0 if it does not.

    Each x in the force must stand in a sine, cosine or tangent of a linear function of x. The periods of these are
    taken at the values of the parameters.
    """
    x, v = sympy.symbols("x v", real=True)
    force = sympy.sympify(spring.force(x, v))
    periods, waves = list[float](), dict[sympy.Expr, sympy.Symbol]()
    for wave in force.atoms(sympy.sin, sympy.cos, sympy.tan):
        slope = sympy.diff(wave.args[0], x)
        if slope.is_number and slope != 0:
            turn = math.pi if isinstance(wave, sympy.tan) else 2 * math.pi
            periods.append(turn / abs(float(slope)))
            waves[wave] = sympy.Dummy()
    if not periods or force.xreplace(waves).has(x):
        return 0.0
    return _least(force, (x, v), functools.reduce(_common, periods))


def _common(first: float, second: float) -> float:
    """Least common multiple of two periods; 0 if there is none."""
    if not first or not second:
        return 0.0
    ratio = Fraction(first / second).limit_denominator(_LARGEST_RATIO)
    known = ratio > 0 and abs(first / second / float(ratio) - 1) < _SAME
    return first * ratio.denominator if known else 0.0


def _least(force: sympy.Expr, state: tuple[sympy.Symbol, ...], period: float) -> float:
    """The least part of a period that is one too: that of sin² x is half that of sin x."""
    evaluate = sympy.lambdify(state, force, "numpy")
    places = np.random.default_rng(0).uniform(-1.0, 1.0, (len(state), _PLACES))
    places[0] *= period
    with np.errstate(all="ignore"):
        here = np.broadcast_to(evaluate(*places), _PLACES)
        for part in _PARTS:
            while period:
                there = evaluate(places[0] + period / part, *places[1:])
                if not np.nanmax(np.abs(there - here)) <= _SAME * np.nanmax(np.abs(here)):
                    break
                period /= part
    return period
