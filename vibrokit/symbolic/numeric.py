"""Formulas of a scene as Python functions of numbers (SymPy's lambdify), for a few evaluations."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import sympy

from vibrokit.symbolic.contact import DEPTH, RATE
from vibrokit.symbolic.equations import Equations
from vibrokit.symbolic.printer import printable

_SAMPLES = 32  # of a period, whose mean is exact for 31 harmonics

Function = Callable[..., float]


def drift_at(model: Equations) -> Callable[[Sequence[float]], list[float]]:
    """Return the drift without stops and without forces of time alone, as a function of a state.

    Of forces that vary in time with the state it has the mean over their period.
    """
    functions = [_function(model, model.state, rate) for rate in model.drift_with(_mean_of_modulated(model), ())]
    return lambda state: [function(*state) for function in functions]


def jacobian_of(model: Equations) -> Callable[[Sequence[float]], list[list[float]]]:
    """Return the derivatives of that drift, shape (n, n), as a function of a state."""
    matrix, size = model.drift_with(_mean_of_modulated(model), ()).jacobian(list(model.state)), len(model.state)
    functions = [[_function(model, model.state, matrix[i, j]) for j in range(size)] for i in range(size)]
    return lambda state: [[function(*state) for function in row] for row in functions]


def amplitude_at(model: Equations, state: Sequence[float]) -> list[float]:
    """Return the factors by which √D dW enters each equation at a state, length n."""
    return [_function(model, model.state, factor)(*state) for factor in model.amplitude]


def excitation_of(model: Equations, index: int, x: float = 0.0) -> Function:
    """Return the force of one excitation (m s⁻²) on a mass at rest at x (m) as a function of time (s)."""
    place = {model.state[0]: sympy.Float(x), model.state[1]: sympy.Integer(0)}
    return _function(model, (model.time,), model.excitations[index].subs(place))


def _mean_of_modulated(model: Equations) -> sympy.Expr:
    """The mean of the forces that depend on the state and vary periodically, besides the steady part; 0 without any."""
    found = sympy.Integer(0)
    if not model.in_time.modulated:
        return found
    for part, force in zip(model.scene.excitations, model.excitations, strict=True):
        if not part.depends_on_state:
            found += force if model.time not in force.free_symbols else 0
        elif part.period is not None and math.isfinite(part.period):
            times = (part.period * k / _SAMPLES for k in range(_SAMPLES))
            found += sum(force.subs(model.numbers).subs(model.time, t) for t in times) / _SAMPLES
    return found - model.in_time.steady


def contact_force_of(model: Equations, index: int) -> Function:
    """Return the force of one stop (m s⁻²) as a function of depth (m, positive) and rate (m s⁻¹)."""
    return _function(model, (DEPTH, RATE), model.contacts[index].law)


def _function(model: Equations, arguments: Sequence[sympy.Symbol], formula: Any) -> Function:
    """Return a formula as a function; NaN where it has no real value."""
    numbers = model.numbers
    formula = printable(sympy.sympify(formula)).subs(numbers)
    raw = sympy.lambdify(list(arguments), formula, modules=[{"sign": _sign}, "math"], dummify=True)

    def evaluated(*values: float) -> float:
        try:
            return float(raw(*values))
        except (ArithmeticError, ValueError, TypeError):  # a power may be complex
            return math.nan

    return evaluated


def _sign(value: float) -> float:
    return float((value > 0) - (value < 0))
