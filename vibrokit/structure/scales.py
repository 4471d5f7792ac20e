"""The size of the motions of a scene, by which lengths are measured so that no result depends on the units."""

from __future__ import annotations

import functools
import math

import numpy as np
from scipy.optimize import minimize_scalar

from vibrokit.kernels.vector_field import VectorField
from vibrokit.oscillator import Oscillator

_RESONANCE = 5.0  # amplification of a periodic force that two stops do not limit
_SAMPLES, _LEAST_SAMPLES = 64, 512  # of a force in 2π/ω_n, and in all; its maximum is refined from the largest
_LONGEST = 1024  # units of 2π/ω_n over which a force is sampled, if its period is longer


@functools.lru_cache(maxsize=256)
def length_of(osc: Oscillator) -> float:
    """Return the distance that the mass may be expected to move (m).

    It is the larger of twice the distance to the stops and the deflection of a spring ω_n² by the largest forces of
    the excitations. Where two stops do not limit a resonance, it multiplies the deflection by periodic forces. A scene
    with neither stops nor forces has no length scale; its length is 1.
    """
    field, push = VectorField(osc), 0.0
    for index, part in enumerate(osc.excitations):
        resonant = len(osc.barriers) < 2 and part.period is not None
        largest = _largest_force(field, index, part.period, 2 * math.pi / osc.natural_frequency)
        push += largest * (_RESONANCE if resonant else 1.0) / osc.natural_frequency**2
    return max([push, *(2 * abs(barrier.position) for barrier in osc.barriers)]) or 1.0


def size_of(osc: Oscillator) -> float:
    """Return the size of states (x, v) that goes with it, x and v taken together."""
    return length_of(osc) * math.hypot(1.0, osc.natural_frequency)


def _largest_force(field: VectorField, index: int, period: float | None, turn: float) -> float:
    """Largest absolute value of an excitation over its period; `turn` is 2π/ω_n."""

    def force(time: float) -> float:
        return abs(field.excitation(index, time))

    if period is None:
        return force(0.0)
    span = min(period, _LONGEST * turn)
    times, spacing = np.linspace(
        0.0, span, max(_LEAST_SAMPLES, math.ceil(_SAMPLES * span / turn)), endpoint=False, retstep=True
    )
    near = max(times, key=force)
    refined = minimize_scalar(
        lambda time: -force(time), bounds=(near - spacing, near + spacing), method="bounded",
        options={"xatol": 1e-9 * spacing},
    )  # fmt: skip
    return max(force(near), -float(refined.fun))
