"""Refuses derivatives of motion under forces of a spring that jump, or rise as steeply as a jump nearly."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import mpmath
import sympy

from vibrokit.errors import DerivationError
from vibrokit.symbolic.friction import switches_of
from vibrokit.symbolic.printer import as_text
from vibrokit.symbolic.switching import DIGITS, NEAR, NEARER, Function, points_of, real_value, zeros_of

_DRAWS = 8  # of the other variables and parameters
_JUMP = 0.01  # power of the distance below which a change is a jump
_ROOT = 0.499  # the same, of the root, with its rounding


def refuse_rough(part: Any, force: sympy.Expr, variable: sympy.Symbol, values: Mapping[str, sympy.Expr]) -> None:
    """Raise DerivationError if a force changes by less than the root of the distance from a switch in a variable.

    Derivatives of the motion jump where a force does, and steppers locate that at stops only. Where the slope is
    infinite they integrate it, to 1e-6 for √|x|; for |x|^0.2 they were off by 1e-3 to 2 at a tolerance of 1e-10.

    Parameters
    ----------
    part : Part
        The part whose force it is.
    force : sympy.Expr
        Its formula.
    variable : sympy.Symbol
        The position or the velocity.
    values : mapping
        The symbol of each parameter of the part.
    """
    names = {symbol: name for name, symbol in values.items() if symbol in force.free_symbols}
    numbers = {symbol: float(part.parameters[name]) for symbol, name in names.items()}
    others = sorted(force.free_symbols - {variable}, key=str)
    value = sympy.lambdify([variable, *others], force, "mpmath", dummify=True)
    fixed = set().union(*(power.exp.free_symbols for power in force.atoms(sympy.Pow))) & set(numbers)
    with mpmath.workdps(DIGITS):
        for switch in dict.fromkeys([*switches_of(force, variable), *_roots(force, variable)]):
            argument = sympy.lambdify([variable, *others], switch, "mpmath", dummify=True)
            points = points_of(others, numbers, fixed, _DRAWS)
            power = min(_power(value, argument, point) for point in points)
            if power < _ROOT:
                plain = {symbol: sympy.Symbol(name) for symbol, name in names.items()}
                raise _refusal(part, as_text(force.xreplace(plain)), as_text(switch.xreplace(plain)), power)


def _roots(force: sympy.Expr, variable: sympy.Symbol) -> Iterator[sympy.Expr]:
    """Bases of powers at whose zeros a slope may be infinite."""
    for power in force.atoms(sympy.Pow):
        if variable in power.base.free_symbols and power.exp.is_integer is not True:
            yield power.base.args[0] if isinstance(power.base, sympy.Abs) else power.base


def _power(value: Function, argument: Function, point: list[mpmath.mpf]) -> float:
    """Least power of the distance from a zero of a switch with which a force changes there; 1 for none."""
    least = 1.0
    for place in zeros_of(lambda each: real_value(argument, each, point)):
        scale = abs(place) or mpmath.mpf(1)
        wide, narrow = (
            [real_value(value, place + side * near * scale, point) for side in (-1, 1)] for near in (NEAR, NEARER)
        )
        here = real_value(value, place, point)
        here = here if mpmath.isfinite(here) else sum(narrow) / 2
        if abs(here) > 2 * max(map(abs, narrow)):  # next to a pole, which is a border
            continue
        far, close = (max(abs(beside - here) for beside in sides) for sides in (wide, narrow))
        if mpmath.isfinite(far) and mpmath.isfinite(close) and far > 0 < close:
            power = float(mpmath.log10(far / close) / mpmath.log10(NEAR / NEARER))
            least = min(least, power if power > -_JUMP else math.inf)
    return least


def _refusal(part: Any, force: str, switch: str, power: float) -> DerivationError:
    what, advice = "jumps", "give the jump as stops with a constant law, whose touches are located, or in"
    if power > _JUMP:
        what, advice = "rises more steeply than the root of the distance", "give powers of 0.5 or more, or"
    return DerivationError(
        f"{type(part).__name__}: the force {force} {what} where {switch} = 0, and no stepper follows the derivatives "
        f"of the motion across that, which orbits, their multipliers, saddles and exit paths need; {advice} a smooth "
        f"form, such as tanh(({switch})/w) or (({switch})**2 + w**2)**(1/4) with a small width w."
    )
