"""Tones of a periodic force, from samples over a period."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

SAMPLES = 512
"""Samples of a period, by which a mean and the tones are known to rounding where the force is smooth."""

_ROUNDING = 1e-12  # of the largest part of a force


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
    series = np.fft.rfft([force(period * k / SAMPLES) for k in range(SAMPLES)]) * (2 / SAMPLES)
    sizes = np.abs(series)
    floor = max(least * sizes[1 : count + 1].max(), _ROUNDING * sizes.max())
    orders = [order for order in range(1, count + 1) if sizes[order] > floor]
    mean = float(series[0].real) / 2 if sizes[0] > _ROUNDING * sizes.max() else 0.0
    return mean, [Tone(2 * math.pi * order / period, complex(series[order])) for order in orders]
