"""Coefficient of restitution: the speed with which a free mass leaves a stop, over the speed with which it came."""

from __future__ import annotations

import dataclasses
import math
import sys
from collections.abc import Callable
from typing import Any

from vibrokit.parts.parameter import Parameter

_RESTITUTION = Parameter("e", "e", "e", "", above=0, maximum=1)
_SPEED = Parameter("speed", "speed", "v_0", "m s^-1", above=0)


def restitution(owner: str, value: Any) -> float:
    """Return a coefficient of restitution; raise ParameterError if it is not in (0, 1]."""
    return _RESTITUTION.known(owner, value)


def impact_speed(owner: str, value: Any) -> float:
    """Return a speed of impact (m s⁻¹); raise ParameterError if it is not positive."""
    return _SPEED.known(owner, value)


def elastic(owner: str, declared: Parameter, value: Any) -> float:
    """Return a stiffness that drives the mass back, so that there is a restitution; raise ParameterError for 0."""
    return dataclasses.replace(declared, minimum=None, above=0).known(owner, value)


def crossing(function: Callable[[float], float], low: float, high: float) -> float:
    """Return the largest number below the sign change of a function that rises from `low` to `high`, by bisection.

    The function is not evaluated at the ends; where it is nowhere negative, that number is `low`.
    """
    while low < (middle := low + (high - low) / 2) < high:
        if function(middle) < 0:
            low = middle
        else:
            high = middle
    return low


# The family k δⁿ (1 + a δ′/v), hit at speed v. With u = δ′/v the equation of motion is u du/dδ ∝ −δⁿ (1 + a u), so
# that k and n drop out between touching and leaving: a − ln(1 + a) = −a e − ln(1 − a e). With a (1 + e) = 2h this is
# a = h (1 + ℒ(h)) and e = (1 − ℒ(h))/(1 + ℒ(h)), where ℒ(h) = coth h − 1/h is Langevin's function.


def rebound_of_damping(damping: float) -> float:
    """Return the restitution of the law k δⁿ (1 + a δ′/v) at the speed v, for a = `damping`, not negative."""
    return _rebound(crossing(lambda h: h * (1 + _langevin(h)) - damping, 0.0, damping))


def damping_of_rebound(e: float) -> float:
    """Return a of the law k δⁿ (1 + a δ′/v) that has the restitution `e`, in (0, 1], at the speed v."""
    most = min(1.5 * (1 - e) / e, sys.float_info.max)  # for ℒ(h) ≥ h/(3 + h)
    return 2 * crossing(lambda h: e - _rebound(h), 0.0, most) / (1 + e)


def _rebound(h: float) -> float:
    if h <= 1:
        return (1 - _langevin(h)) / (1 + _langevin(h))
    rest = -2 * h * math.exp(-2 * h) / math.expm1(-2 * h)  # of h (1 − ℒ) = 1 − rest, without the difference
    return (1 - rest) / (2 * h - 1 + rest)


def _langevin(h: float) -> float:
    """Langevin's function; where coth h − 1/h would cancel, Lambert's continued fraction h/(3 + h²/(5 + …))."""
    if h > 1:
        return 1 / math.tanh(h) - 1 / h
    denominator = 21.0
    for odd in range(19, 1, -2):
        denominator = odd + h * h / denominator
    return h / denominator
