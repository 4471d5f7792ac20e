"""Refuses forces that jump in the state: in the velocity, as dry friction does, in the displacement, or in others."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping, Sequence
from typing import Any

import mpmath
import sympy

from vibrokit.errors import DerivationError
from vibrokit.parts.noise import NoiseModel
from vibrokit.parts.spring import Spring
from vibrokit.symbolic.printer import as_text
from vibrokit.symbolic.switching import DIGITS, NEAR, NEARER, Function, Slice, real_value, switches_of, zeros_of

_WIDTH = 1e-3  # of the smooth form, in the velocity that the jump changes in a time of 1/ω_n
_DRAWS = 40  # of the other variables and parameters
_SPEEDS = ("v", "rate")
_NOT_LOCATED = "and no stepper locates that, so multipliers and energies would be wrong"


def refuse_jumps(
    part: Any,
    force: sympy.Expr,
    state: Sequence[sympy.Symbol],  # displacement and velocity, or depth and rate, then extra states
    values: Mapping[str, sympy.Expr],  # the symbol of each parameter of the part
    frequency: float,  # (s⁻¹), for the width of the smooth form that the error suggests
) -> None:
    """Raise DerivationError if a force, or a rate or an amplitude of the noise, jumps in a variable of the state.

    Motion may stick where it jumps in the velocity. Elsewhere derivatives of the motion and momenta jump too. Only
    stops have their jumps located.

    A force can jump only where the argument of one of its switches vanishes: of a sign, a step, a condition, or a
    divisor. Its one-sided limits are compared there, at sixty digits, for the scene's own parameters and for random
    ones, so that f*sign(v) is refused at f = 0 too: the same compiled code serves other values of f.
    """
    for variable in sorted(state, key=lambda symbol: symbol.name not in _SPEEDS):  # friction is named first
        _refuse(part, force, variable, values, frequency)


def _refuse(
    part: Any, force: sympy.Expr, speed: sympy.Symbol, values: Mapping[str, sympy.Expr], frequency: float
) -> None:
    if not (switches := switches_of(force, speed)):
        return
    slice_ = Slice(part, force, speed, values)
    with mpmath.workdps(DIGITS):
        for switch in switches:
            jump = functools.partial(_jump, slice_.value, slice_.function_of(switch), positive=speed.is_positive)
            if any(jump(point) > 0 for point in slice_.points(_DRAWS)):
                steps = [jump(point) for point in slice_.points(3, own=True)]
                plain = {symbol: sympy.Symbol(name) for symbol, name in slice_.names.items()}
                raise _refusal(part, force.xreplace(plain), switch.xreplace(plain), speed, steps, frequency)


def _jump(value: Function, argument: Function, point: list[mpmath.mpf], positive: bool | None) -> float:
    """Largest jump of the force where the argument of a switch changes its sign, or is zero at rest; 0 for none.

    Of a variable that is `positive` other values do not count.
    """
    largest = 0.0
    for place in zeros_of(lambda speed: real_value(argument, speed, point)):
        if positive and place <= 0:
            continue
        sides = [
            (real_value(value, place - near, point), real_value(value, place + near, point))
            for near in (NEAR * (abs(place) or 1), NEARER * (abs(place) or 1))
        ]
        wide, narrow = (abs(after - before) for before, after in sides)
        # False for NaN. A pole grows, a continuous function shrinks, and the error of the place leaves less than this.
        if wide / 2 < narrow < 2 * wide and narrow > NEARER * max(map(abs, sides[1])):
            largest = max(largest, float(narrow))
    return largest


def _refusal(
    part: Any,
    force: sympy.Expr,
    switch: sympy.Expr,
    variable: sympy.Symbol,
    steps: list[float],
    frequency: float,
) -> DerivationError:
    same = 0.0 < steps[0] < math.inf and math.isclose(min(steps), max(steps), rel_tol=1e-9)
    fast = variable.name in _SPEEDS and not isinstance(part, NoiseModel)
    unit = steps[0] / (2 * frequency ** (1 if fast else 2)) if same else 1.0
    width = sympy.Symbol(f"{_WIDTH * unit:.1g}")
    size = f" by {steps[0]:.6g}" if same else ""
    smooth = _smooth(force, variable, width)
    form = f"a smooth form, such as {as_text(smooth)}"
    if smooth == force:
        form = f"the jump as {as_text(sympy.tanh(switch / width))}"
    reason = "as dry friction does, and no stepper holds a mass that sticks there" if fast else _NOT_LOCATED
    other = "; a stop of a CustomLaw may have it at first touch" if isinstance(part, Spring) and not fast else ""
    what = "formula" if isinstance(part, NoiseModel) else "force"
    return DerivationError(
        f"{type(part).__name__}: the {what} {as_text(force)} jumps{size} where {as_text(switch)} = 0, {reason}; "
        f"write {form}, with a width, here {width}, well below the values of {variable} of interest{other}."
    )


def _smooth(force: sympy.Expr, speed: sympy.Symbol, width: sympy.Symbol) -> sympy.Expr:
    """The force with smooth signs and steps."""
    if not force.has(sympy.sign, sympy.Heaviside):
        force = force.replace(sympy.Abs, lambda argument: argument * sympy.sign(argument))
        force = force.replace(lambda node: node.is_Pow and node.base.func == sympy.sign, lambda node: node.base)
    force = force.replace(sympy.sign, lambda argument: sympy.tanh(argument / width) if argument.has(speed) else None)
    return force.replace(sympy.Heaviside, lambda argument, *_: (1 + sympy.tanh(argument / width)) / 2)
