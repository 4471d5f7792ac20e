"""Refuses forces that jump in the velocity, as dry friction does."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import mpmath
import numpy as np
import sympy

from vibrokit.errors import DerivationError
from vibrokit.symbolic.printer import as_text

_DRAWS = 40  # of the other variables and parameters
_DECADES = 6.0  # their sizes are 10^±6; so are the velocities between which a switch is sought
_GRID = sorted(
    mpmath.mpf(sign * 10.0 ** (step / 4)) for sign in (-1, 0, 1) for step in range(-24, 25) if sign or not step
)
_DIGITS = 60
_NEAR, _NEARER = mpmath.mpf("1e-10"), mpmath.mpf("1e-20")  # of a switch; continuous functions differ across the two
_WIDTH = 1e-3  # of the smooth form, in the velocity that the jump changes in a time of 1/ω_n
_SWITCHES = (
    sympy.sign, sympy.Heaviside, sympy.floor, sympy.ceiling, sympy.frac, sympy.Mod, sympy.acot, sympy.atan2,
)  # fmt: skip

Function = Callable[..., Any]


def refuse_friction(
    part: Any, force: sympy.Expr, speed: sympy.Symbol, values: Mapping[str, sympy.Expr], natural_frequency: float
) -> None:
    """Raise DerivationError if a force jumps in `speed`, where motion may stick, which no stepper follows.

    A force can jump only where the argument of one of its switches vanishes: of a sign, a step, a condition, or a
    divisor. Its one-sided limits are compared there, at sixty digits, for the scene's own parameters and for random
    ones, so that f*sign(v) is refused at f = 0 too: the same compiled code serves other values of f.

    Parameters
    ----------
    part : Part
        The part whose force it is.
    force : sympy.Expr
        Its formula.
    speed : sympy.Symbol
        The velocity or the rate among the symbols of the formula.
    values : mapping
        The symbol of each parameter of the part.
    natural_frequency : float
        ω_n (s⁻¹), for the width of the smooth form that the error suggests.
    """
    switches = _switches(force, speed)
    if not switches:
        return
    names = {symbol: name for name, symbol in values.items() if symbol in force.free_symbols}
    numbers = {symbol: float(part.parameters[name]) for symbol, name in names.items()}
    others = sorted(force.free_symbols - {speed}, key=str)
    value = sympy.lambdify([speed, *others], force, "mpmath", dummify=True)
    fixed = set().union(*(power.exp.free_symbols for power in force.atoms(sympy.Pow))) & set(numbers)
    with mpmath.workdps(_DIGITS):
        for switch in switches:
            argument = sympy.lambdify([speed, *others], switch, "mpmath", dummify=True)
            for point in _points(others, numbers, fixed):
                if _jump(value, argument, point) > 0:
                    steps = [_jump(value, argument, each) for each in _points(others, numbers, set(numbers), 3)]
                    plain = {symbol: sympy.Symbol(name) for symbol, name in names.items()}
                    raise _refusal(part, force.xreplace(plain), switch.xreplace(plain), speed, steps, natural_frequency)


def _switches(force: sympy.Expr, speed: sympy.Symbol) -> list[sympy.Expr]:
    """Expressions at whose zeros the force may jump in the speed."""
    found: list[sympy.Expr] = []
    for node in sympy.preorder_traversal(force):
        if isinstance(node, sympy.Mod):
            found += [node.args[0] / node.args[1]]
        elif isinstance(node, _SWITCHES):
            found += node.args
        elif isinstance(node, sympy.core.relational.Relational):
            found.append(node.lhs - node.rhs)
        elif isinstance(node, sympy.Pow) and node.exp.is_nonnegative is not True:
            found.append(node.base.args[0] if isinstance(node.base, sympy.Abs) else node.base)
        if isinstance(node, sympy.floor | sympy.ceiling | sympy.frac | sympy.Mod):  # at 0 a factor may hide the jump
            found.append(found[-1] - 1)
    return [each for each in dict.fromkeys(found) if speed in each.free_symbols]


def _points(
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


def _jump(value: Function, argument: Function, point: list[mpmath.mpf]) -> float:
    """Largest jump of the force where the argument of a switch changes its sign, or is zero at rest; 0 for none."""
    largest = 0.0
    for place in _zeros(lambda speed: _real(argument, speed, point)):
        sides = [
            (_real(value, place - near, point), _real(value, place + near, point))
            for near in (_NEAR * (abs(place) or 1), _NEARER * (abs(place) or 1))
        ]
        wide, narrow = (abs(after - before) for before, after in sides)
        # False for NaN. A pole grows, a continuous function shrinks, and the error of the place leaves less than this.
        if wide / 2 < narrow < 2 * wide and narrow > _NEARER * max(map(abs, sides[1])):
            largest = max(largest, float(narrow))
    return largest


def _zeros(argument: Callable[[Any], mpmath.mpf]) -> Iterator[mpmath.mpf]:
    """Speeds at which an argument changes its sign or is zero, as far as a grid shows them."""
    signs = [mpmath.sign(argument(place)) for place in _GRID]
    yield from (place for place, sign in zip(_GRID, signs, strict=True) if sign == 0)
    for (low, high), (before, after) in zip(itertools.pairwise(_GRID), itertools.pairwise(signs), strict=True):
        if before * after < 0:
            yield _bisected(argument, low, high, before)


def _bisected(argument: Callable[[Any], mpmath.mpf], low: mpmath.mpf, high: mpmath.mpf, sign: Any) -> mpmath.mpf:
    while abs(high - low) > _NEARER**2 * max(abs(low), abs(high)):
        middle = (low + high) / 2
        if mpmath.sign(argument(middle)) == sign:
            low = middle
        else:
            high = middle
    return (low + high) / 2


def _real(function: Function, speed: mpmath.mpf, point: list[mpmath.mpf]) -> mpmath.mpf:
    """Value of a function, NaN where it has no real one."""
    try:
        return mpmath.mpf(function(speed, *point))
    except (ArithmeticError, TypeError, ValueError):
        return mpmath.nan


def _refusal(
    part: Any, force: sympy.Expr, switch: sympy.Expr, speed: sympy.Symbol, steps: list[float], natural_frequency: float
) -> DerivationError:
    same = 0.0 < steps[0] < math.inf and math.isclose(min(steps), max(steps), rel_tol=1e-9)
    width = sympy.Symbol(f"{_WIDTH * steps[0] / (2 * natural_frequency) if same else _WIDTH:.1g}")
    size = f" by {steps[0]:.6g}" if same else ""
    smooth = _smooth(force, speed, width)
    form = f"a smooth form, such as {as_text(smooth)}"
    if smooth == force:
        form = f"the jump as {as_text(sympy.tanh(switch / width))}"
    return DerivationError(
        f"{type(part).__name__}: the force {as_text(force)} jumps{size} where {as_text(switch)} = 0, as dry friction "
        f"does, and no stepper holds a mass that sticks there; write {form}, with a width, here {width}, well below "
        f"the velocities of interest."
    )


def _smooth(force: sympy.Expr, speed: sympy.Symbol, width: sympy.Symbol) -> sympy.Expr:
    """The force with smooth signs and steps."""
    if not force.has(sympy.sign, sympy.Heaviside):
        force = force.replace(sympy.Abs, lambda argument: argument * sympy.sign(argument))
        force = force.replace(lambda node: node.is_Pow and node.base.func == sympy.sign, lambda node: node.base)
    force = force.replace(sympy.sign, lambda argument: sympy.tanh(argument / width) if argument.has(speed) else None)
    return force.replace(sympy.Heaviside, lambda argument, *_: (1 + sympy.tanh(argument / width)) / 2)
