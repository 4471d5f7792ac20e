"""The motion of a linear oscillator from rest under a force of time, by Duhamel's integral.

A force may jump and have pulses. The integral is a sum over narrow panels, which are divided where the force jumps.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import sympy
from numpy.typing import NDArray

PANELS = 2**19  # steppers look for pulses at 2**16 times
_SEEN = 0.01  # of the range of the force: jumps below it are not located, and matter 1e-2/PANELS at most
_HALVINGS = 60

Array = NDArray[np.float64]


class Forcing:
    """A force of time in double precision."""

    def __init__(self, formula: sympy.Expr, time: sympy.Symbol, values: Mapping[sympy.Symbol, float]) -> None:
        whole = formula.rewrite(sympy.Piecewise)  # NumPy has no Max of a number and an array
        self._raw = sympy.lambdify([time, *values], whole, modules="numpy", dummify=True)
        self._numbers = tuple(values.values())

    def at(self, times: Array) -> Array:
        """The force at times."""
        found: Array = np.asarray(self._raw(times, *self._numbers), dtype=float)
        return np.broadcast_to(found, times.shape)

    def varies(self, period: float) -> bool:
        """Whether the force varies within a period."""
        return float(np.ptp(self.at(_times(period)))) > 0.0

    def repeats(self, period: float, shift: float) -> bool:
        """Whether a shift in time leaves the force as it is."""
        times = _times(period)
        here = self.at(times)
        return float(np.abs(self.at(times + shift) - here).max()) <= 1e-9 * float(np.ptp(here))

    def jumps(self, duration: float) -> Array:
        """Times of jumps, by halving the panels in which the force changes most."""
        times = np.linspace(0.0, duration, PANELS + 1)
        force = self.at(times)
        changes = np.abs(np.diff(force))
        found = [self._jump(times[k], times[k + 1]) for k in np.flatnonzero(changes > _SEEN * np.ptp(force))]
        return np.array([time for time in found if not math.isnan(time)])

    def _jump(self, left: float, right: float) -> float:
        """The place of a jump between two times; NaN where the force is continuous."""
        low, high = self.at(np.array([left, right]))
        first = abs(high - low)
        for _ in range(_HALVINGS):
            middle = (left + right) / 2
            if not left < middle < right:
                break
            force = float(self.at(np.array([middle]))[0])
            left, right, low, high = (
                (left, middle, low, force) if abs(force - low) > abs(high - force) else (middle, right, force, high)
            )
            if abs(high - low) < first / 4:
                return math.nan
        return right


def _times(period: float) -> Array:
    """Times of a period, which seldom are of jumps."""
    return np.linspace(0.0, period, PANELS, endpoint=False) + period / PANELS / math.pi


def motion_from_rest(forcing: Forcing, damping_ratio: float, duration: float) -> tuple[Array, float]:
    """Return (x, v) at the end, for ω_n = 1, and the size of the motion: the largest impulse of the force in it."""
    edges = np.union1d(np.linspace(0.0, duration, PANELS + 1), forcing.jumps(duration))
    middles, widths = (edges[1:] + edges[:-1]) / 2, np.diff(edges)
    impulses = forcing.at(middles) * widths
    rest, decay = duration - middles, math.sqrt(1 - damping_ratio**2)
    fading = np.exp(-damping_ratio * rest)
    sines, cosines = np.sin(decay * rest), np.cos(decay * rest)
    x = math.fsum(impulses * fading * sines / decay)
    v = math.fsum(impulses * fading * (cosines - damping_ratio / decay * sines))
    return np.array([x, v]), float(np.abs(np.cumsum(impulses)).max())
