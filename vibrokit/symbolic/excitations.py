"""The force of an excitation, derived and checked."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import sympy

from vibrokit.errors import DerivationError
from vibrokit.parts.excitation import Excitation
from vibrokit.symbolic.borders import borders_of
from vibrokit.symbolic.formulas import derived_formula
from vibrokit.symbolic.jumps import refuse_jumps
from vibrokit.symbolic.printer import as_text
from vibrokit.symbolic.roughness import roughness_of

_SHARES = (0.0341, 0.2163, 0.4527, 0.6194, 0.8812)  # of a period, where a pulse seldom begins or ends
_STATES = ((0.31, 0.17), (-0.47, 0.83))  # (x, v) at which a force that depends on them is compared
_SAME = 1e-6  # of the largest force: a period with seven digits repeats


def excitation_force(
    part: Excitation,
    symbols: Mapping[str, sympy.Symbol],  # of each parameter of the part
    time: sympy.Symbol,
    state: Sequence[sympy.Symbol],  # x and v
    reference_frequency: float,  # (s⁻¹), for the width of the smooth form that an error suggests
) -> sympy.Expr:
    """Return the force of an excitation as an expression in the time, and in x and v if it depends on them.

    DerivationError is raised if its period is wrong, or if it is not smooth in the state.
    """
    arguments = dict(zip(("t", "x", "v"), (time, *state), strict=True))
    force = derived_formula(part, "force", symbols, tuple(arguments[name] for name in part.variables))
    if len(part.variables) > 1:
        _check_smooth(part, force, symbols, state, reference_frequency)
    check_period(part, force, symbols, time, state)
    return force


def support_displacement(part: Excitation, symbols: Mapping[str, sympy.Symbol], time: sympy.Symbol) -> sympy.Expr:
    """Return the displacement of the support as an expression in the time.

    DerivationError is raised if its period is wrong, or if it has no derivative in time.
    """
    place = derived_formula(part, "support", symbols, (time,))
    check_period(part, place, symbols, time, ())
    if sympy.diff(place, time).has(sympy.Derivative, sympy.Subs, sympy.DiracDelta):
        plain = place.xreplace({symbol: sympy.Symbol(name) for name, symbol in symbols.items()})
        raise DerivationError(
            f"{type(part).__name__}: the displacement {as_text(plain)} of the support has no derivative in time, which "
            "the damper needs; write a displacement that does not jump."
        )
    return place


def refuse_moving_borders(held: sympy.Expr, state: tuple[sympy.Symbol, ...]) -> None:
    """Refuse to move the support of a spring whose force has poles or ends: these would move with it."""
    for border in borders_of(held, state):
        raise DerivationError(
            f"the force of the spring may have no value where {as_text(border.gauge)} = 0, a place that would move "
            "with the support, and no stepper watches a border that moves; give a spring that has a force everywhere, "
            "or let the stops move with the support (SupportMotion)."
        )


def _check_smooth(
    part: Excitation,
    force: sympy.Expr,
    symbols: Mapping[str, sympy.Symbol],
    state: Sequence[sympy.Symbol],
    reference_frequency: float,
) -> None:
    """Refuse a force that jumps, is steep, or has no value at some state: nothing locates such a place in time."""
    refuse_jumps(part, force, state, symbols, reference_frequency)
    plain = {symbol: sympy.Symbol(name) for name, symbol in symbols.items()}
    rough = roughness_of(part, force, state, symbols)
    if rough.steep:
        raise DerivationError(
            f"{type(part).__name__}: the slope of the force {as_text(force.xreplace(plain))} is infinite where "
            f"{as_text(rough.switch.xreplace(plain))} = 0; a force that varies in time must be smooth in x and v, as "
            "(x**2 + w**2)**(1/4) is with a small w."
        )
    for border in borders_of(force, tuple(state)):
        raise DerivationError(
            f"{type(part).__name__}: the force {as_text(force.xreplace(plain))} may have no value where "
            f"{as_text(border.gauge.xreplace(plain))} = 0; a force that varies in time must have values at all x and "
            "v. Declare the ranges of its parameters, if they exclude that."
        )


def check_period(
    part: Excitation,
    force: sympy.Expr,
    symbols: Mapping[str, sympy.Symbol],
    time: sympy.Symbol,
    state: Sequence[sympy.Symbol],
) -> None:
    """Refuse an excitation that does not repeat after its period, as with 1/f where 2π/ω is meant."""
    name, period = type(part).__name__, part.period
    if period is None and time in force.free_symbols:
        raise DerivationError(
            f"{name}.period is None, which means a constant, but its force depends on time; return the period, or "
            "math.inf if it never repeats."
        )
    if period is None or not math.isfinite(period):
        return
    numbers = {symbol: part.parameters[name] for name, symbol in symbols.items()}
    for place in _STATES if part.depends_on_state else _STATES[:1]:
        at = _over_periods(force.subs(numbers).subs(dict(zip(state, place, strict=False))), time, period)
        change = max(abs(at(share + 1) - at(share)) for share in _SHARES)
        if change > _SAME * max(abs(at(share)) for share in _SHARES):
            raise DerivationError(
                f"{name}.period is {period:.10g}, but its force changes by {change:.3g} from one period to the next; "
                "return a period of the force, or math.inf if it never repeats."
            )


def _over_periods(force: sympy.Expr, time: sympy.Symbol, period: float) -> Callable[[float], complex]:
    """A force as a function of the time in periods."""
    return lambda share: complex(force.subs(time, period * share))
