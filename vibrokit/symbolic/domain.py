"""Domain: the intervals of x between the borders of a scene, at the values of its parameters."""

from __future__ import annotations

import itertools
import math
import warnings
from collections.abc import Callable, Iterable, Sequence

import numpy as np
import sympy
from numpy.typing import NDArray

from vibrokit.symbolic.borders import Border

_DECADES, _PER_DECADE, _PLACES = 12, 100, 4096  # places where a gauge without a formula for its zeros is evaluated
_MOST_ZEROS = 64  # of a sine, on either side of x = 0, where nothing bounds x
_REAL = 1e-9  # relative imaginary part of a zero of a polynomial that is real

Array = NDArray[np.float64]


class Domain:
    """Where on the x-axis a mass at rest has a force, and where it has not.

    Parameters
    ----------
    borders : iterable of Border
        With numbers in place of everything but x.
    x : sympy.Symbol
    """

    def __init__(self, borders: Iterable[Border], x: sympy.Symbol) -> None:
        found = [(_gauge(b, x), _zeros(b, x), b.pole) for b in borders if b.exists and b.gauge.has(x)]
        self._gauges = [(g, zeros, pole) for g, zeros, pole in found if zeros(-math.inf, math.inf)]

    def __bool__(self) -> bool:
        """Whether there are borders at all; a formula without a value anywhere counts as one without."""
        return bool(self._gauges)

    def borders(self, low: float = -math.inf, high: float = math.inf) -> list[float]:
        """Return the borders between two places (m), in ascending order."""
        found = {zero for _, zeros, _ in self._gauges for zero in zeros(low, high) if low < zero < high}
        return sorted(found)

    def intervals(self, low: float = -math.inf, high: float = math.inf) -> list[tuple[float, float]]:
        """Return the intervals between two places (m) in which the force has a value, in ascending order."""
        ends = [low, *self.borders(low, high), high]
        return [(one, other) for one, other in itertools.pairwise(ends) if self._holds(_inside(one, other))]

    def around(self, x: float) -> tuple[float, float]:
        """Return the interval that contains a place (m), or else the nearest; of two, the one on the right."""
        if not self._gauges:
            return -math.inf, math.inf
        found = self.intervals() or [(-math.inf, math.inf)]
        return min(found, key=lambda ends: (max(ends[0] - x, x - ends[1], 0.0), not ends[0] <= x < ends[1]))

    def _holds(self, x: float) -> bool:
        return all(pole or gauge(np.array([x]))[0] > 0 for gauge, _, pole in self._gauges)


def border_ahead(
    borders: Sequence[Border], state: Sequence[sympy.Symbol], place: Sequence[float], change: Sequence[float]
) -> tuple[int, list[float]] | None:
    """Return which border is the first on the straight way from a state to place + change, and where it is met.

    The borders have numbers in place of parameters. None if there is no border on the way.
    """
    share = sympy.Symbol("share", real=True)
    way = {q: sympy.Float(at) + share * sympy.Float(by) for q, at, by in zip(state, place, change, strict=True)}
    met = [
        (zero, number)
        for number, border in enumerate(borders)
        for zero in _zeros(border.at(way), share)(0.0, 1.0)
        if 0.0 <= zero <= 1.0
    ]
    if not met:
        return None
    first, number = min(met)
    return number, [at + first * by for at, by in zip(place, change, strict=True)]


def _inside(low: float, high: float) -> float:
    """A place between two others, either of which may be infinite."""
    if math.isinf(low) and math.isinf(high):
        return 0.0
    if math.isinf(low):
        return high - max(1.0, abs(high))
    return low + max(1.0, abs(low)) if math.isinf(high) else 0.5 * (low + high)


def _gauge(border: Border, x: sympy.Symbol) -> Callable[[Array], Array]:
    function = sympy.lambdify(x, border.gauge, "numpy")

    def values(places: Array) -> Array:
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a gauge may have a domain of its own
            return np.broadcast_to(np.asarray(function(places), dtype=float), places.shape)

    return values


def _zeros(border: Border, x: sympy.Symbol) -> Callable[[float, float], list[float]]:
    """A function that returns the zeros of a gauge between two places."""
    gauge = border.gauge
    if gauge.is_polynomial(x):
        roots = np.roots([float(c) for c in sympy.Poly(gauge, x).all_coeffs()])
        real = sorted(float(root.real) for root in roots if abs(root.imag) <= _REAL * abs(root))
        return lambda low, high: real
    argument = gauge.args[0] if isinstance(gauge, sympy.sin | sympy.cos) else sympy.Integer(0)
    if argument.is_polynomial(x) and sympy.degree(argument, x) == 1:
        rate, phase = (float(c) for c in sympy.Poly(argument, x).all_coeffs())
        offset = (0.5 * math.pi if isinstance(gauge, sympy.cos) else 0.0) - phase
        return lambda low, high: _multiples(offset / rate, math.pi / abs(rate), low, high)
    function = _gauge(border, x)
    return lambda low, high: _changes_of_sign(function, low, high)


def _multiples(first: float, spacing: float, low: float, high: float) -> list[float]:
    """Places `first` + n `spacing` between two others, of which those near 0 count if one is infinite."""
    most = _MOST_ZEROS * spacing
    low, high = max(low, min(high, 0.0) - most), min(high, max(low, 0.0) + most)
    return [first + spacing * n for n in range(math.ceil((low - first) / spacing), int((high - first) // spacing) + 1)]


def _changes_of_sign(gauge: Callable[[Array], Array], low: float, high: float) -> list[float]:
    away = np.geomspace(10.0**-_DECADES, 10.0**_DECADES, 2 * _DECADES * _PER_DECADE + 1)
    even = np.linspace(low, high, _PLACES) if math.isfinite(high - low) else np.zeros(1)
    places = np.unique([*-away, *away, *even])
    places = places[(places >= low) & (places <= high)]
    inside = gauge(places) > 0  # NaN, beyond a domain, is not
    at = np.flatnonzero(inside[:-1] != inside[1:])
    return [_last_inside(gauge, float(places[k]), float(places[k + 1])) for k in at]


def _last_inside(gauge: Callable[[Array], Array], low: float, high: float) -> float:
    """Where a gauge stops or begins to be positive between two places; NaN, beyond a domain, is not positive.

    The result is exact to the last bit, so that it is the same from all pairs of places.
    """
    inside = gauge(np.array([low]))[0] > 0
    while low < (middle := 0.5 * (low + high)) < high:
        low, high = (middle, high) if (gauge(np.array([middle]))[0] > 0) == inside else (low, middle)
    return low if inside else high
