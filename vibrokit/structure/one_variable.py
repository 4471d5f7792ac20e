"""Functions of one variable, from samples: roots, and the tones of periodic functions."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, minimize_scalar

Array = NDArray[np.float64]


def bracketed_roots(function: Callable[[float], float], places: Array, values: Array) -> list[float]:
    """Return the roots of a function, in ascending order, from its values at ascending places.

    Roots lie where the sign changes. Where the function comes near 0 and turns back, the place nearest to 0 is located,
    so that the two roots of a pair closer together than the samples are found. Values that are not finite bound a part
    without roots. Where the function is 0 all along a stretch, there is none.
    """

    def root(low: float, high: float) -> float:
        return float(brentq(function, low, high, xtol=min(2e-12, 1e-10 * (high - low))))  # in any unit

    zero = np.concatenate([[False], values == 0, [False]])
    found = [float(place) for place in places[zero[1:-1] & ~zero[:-2] & ~zero[2:]]]
    crossed = np.flatnonzero(values[:-1] * values[1:] < 0)
    found += [root(places[at], places[at + 1]) for at in crossed]
    sizes = np.abs(values)
    same = (values[:-2] * values[1:-1] > 0) & (values[1:-1] * values[2:] > 0)
    for at in 1 + np.flatnonzero(same & (sizes[1:-1] < sizes[:-2]) & (sizes[1:-1] <= sizes[2:])):
        side, low, high = np.sign(values[at]), places[at - 1], places[at + 1]
        nearest = minimize_scalar(
            lambda place, side=side: side * function(place),
            bounds=(low, high),
            options={"xatol": 1e-8 * (high - low)},
        )
        if nearest.fun <= 0:
            found += [root(low, nearest.x), root(nearest.x, high)]
    return sorted(found)


class Tone(NamedTuple):
    """The part Re F exp(iωt) of a periodic force; F is its complex amplitude."""

    frequency: float
    amplitude: complex

    @property
    def force(self) -> float:
        """|F|."""
        return abs(self.amplitude)

    @property
    def phase(self) -> float:
        """arg F."""
        return cmath.phase(self.amplitude)


def tones(force: Callable[[float], float], period: float, count: int, least: float) -> tuple[float, list[Tone]]:
    """Return the mean of a force over its period, and its lowest tones without those below a part of the largest."""
    samples = 512  # with which both are known to rounding where the force is smooth
    series = np.fft.rfft([force(period * k / samples) for k in range(samples)]) * (2 / samples)
    sizes = np.abs(series)
    rounding = 1e-12 * sizes.max()
    floor = max(least * sizes[1 : count + 1].max(), rounding)
    orders = [order for order in range(1, count + 1) if sizes[order] > floor]
    mean = float(series[0].real) / 2 if sizes[0] > rounding else 0.0
    return mean, [Tone(2 * math.pi * order / period, complex(series[order])) for order in orders]
