"""Formulas of a scene as Python functions of numbers (SymPy's lambdify), for a few evaluations."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import sympy

from vibrokit.symbolic.contact import DEPTH, RATE
from vibrokit.symbolic.equations import Equations
from vibrokit.symbolic.printer import printable

Function = Callable[..., float]


def drift_at(model: Equations) -> Callable[[Sequence[float]], list[float]]:
    """Return the drift without stops and without excitations that depend on time, as a function of a state."""
    functions = [_function(model, model.state, rate) for rate in model.drift_with(sympy.Integer(0), ())]
    return lambda state: [function(*state) for function in functions]


def jacobian_of(model: Equations) -> Callable[[Sequence[float]], list[list[float]]]:
    """Return the derivatives of that drift, shape (n, n), as a function of a state."""
    matrix, size = model.drift_with(sympy.Integer(0), ()).jacobian(list(model.state)), len(model.state)
    functions = [[_function(model, model.state, matrix[i, j]) for j in range(size)] for i in range(size)]
    return lambda state: [[function(*state) for function in row] for row in functions]


def amplitude_at(model: Equations, state: Sequence[float]) -> list[float]:
    """Return the factors by which √D dW enters each equation at a state, length n."""
    return [_function(model, model.state, factor)(*state) for factor in model.amplitude]


def excitation_of(model: Equations, index: int) -> Function:
    """Return the force of one excitation (m s⁻²) as a function of time (s)."""
    return _function(model, (model.time,), model.excitations[index])


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
