"""Where the force of a spring jumps, or its slope is infinite."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping, Sequence

import mpmath
import sympy

from vibrokit.errors import DerivationError
from vibrokit.parts.part import Part
from vibrokit.symbolic.printer import as_text
from vibrokit.symbolic.switching import DIGITS, NEAR, NEARER, Function, Slice, real_value, switches_of, zeros_of

_DRAWS = 8  # of the other variables and parameters
_JUMP = 0.01  # power of the distance below which a change is a jump
_ROOT = 0.499  # the same, of the root, with its rounding
_KINK = 0.99  # the same, of a kink


@dataclasses.dataclass(frozen=True)
class Roughness:
    """Where a force is least smooth.

    Attributes
    ----------
    power : float
        Power of the distance with which the force changes there: 0 at a jump, below 1 where its slope is infinite.
    switch : sympy.Expr
        It is 0 there.
    """

    power: float = 1.0
    switch: sympy.Expr = sympy.S.Zero

    @property
    def steep(self) -> bool:
        """Whether the force jumps or its slope is infinite, so that fixed steps lose more order than at a kink."""
        return self.power < _KINK


def roughness_of(
    part: Part, force: sympy.Expr, variables: Sequence[sympy.Symbol], values: Mapping[str, sympy.Expr]
) -> Roughness:
    """Find where a force of a part is least smooth in some variables.

    `values` has the symbol of each parameter of the part.
    """
    least = Roughness()
    for variable in variables:
        slice_ = Slice(part, force, variable, values)
        for switch in dict.fromkeys([*switches_of(force, variable), *_roots(force, variable)]):
            argument = slice_.function_of(switch)
            with mpmath.workdps(DIGITS):
                power = min(_power(slice_.value, argument, point) for point in slice_.points(_DRAWS))
            least = min(least, Roughness(power, switch), key=lambda each: each.power)
    return least


def refuse_rough(part: Part, force: sympy.Expr, found: Roughness, values: Mapping[str, sympy.Expr]) -> None:
    """Raise DerivationError if derivatives of the motion cannot be followed under a force.

    They jump where a force does, and steppers locate that at stops only. Where the slope is infinite steppers
    integrate it, to 1e-6 for √|x|; for |x|^0.2 they were off by 1e-3 to 2 at a tolerance of 1e-10.
    """
    if found.power >= _ROOT:
        return
    plain = {symbol: sympy.Symbol(name) for name, symbol in values.items()}
    switch = as_text(found.switch.xreplace(plain))
    what, advice = "jumps", "give the jump as stops with a constant law, whose touches are located, or in"
    if found.power > _JUMP:
        what, advice = "rises more steeply than the root of the distance", "give powers of 0.5 or more, or"
    raise DerivationError(
        f"{type(part).__name__}: the force {as_text(force.xreplace(plain))} {what} where {switch} = 0, and no stepper "
        f"follows the derivatives of the motion across that, which orbits, their multipliers, saddles and exit paths "
        f"need; {advice} a smooth form, such as tanh(({switch})/w) or (({switch})**2 + w**2)**(1/4) with a small "
        "width w."
    )


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
