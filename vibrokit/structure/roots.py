"""Roots of a function of one variable, pairs of them between two samples included."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, minimize_scalar

Array = NDArray[np.float64]


def bracketed_roots(function: Callable[[float], float], places: Array, values: Array) -> list[float]:
    """Return the roots of a function, in ascending order, from its values at ascending places.

    Roots lie where the sign changes. Where the function comes near 0 and turns back, the place nearest to 0 is located,
    so that the two roots of a pair closer together than the samples are found. Values that are not finite bound a part
    without roots.
    """

    def root(low: float, high: float) -> float:
        return float(brentq(function, low, high, xtol=min(2e-12, 1e-10 * (high - low))))  # in any unit

    found = [float(place) for place in places[values == 0]]
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
