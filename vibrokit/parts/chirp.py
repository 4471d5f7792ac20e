"""Chirp: a sine whose frequency changes with time."""

from __future__ import annotations

import math
from typing import Any

from vibrokit.parts.excitation import Excitation
from vibrokit.parts.functions import And, Piecewise, cos
from vibrokit.parts.parameter import parameter


class Chirp(Excitation):
    """Swept sine from t = 0 to D: f cos(φ + ω_0 t + (ω_1 − ω_0) t²/(2D)); no force before and after.

    The frequency changes linearly from ω_0 to ω_1. The force never repeats, so that there is no section: follow it with
    ``trajectory(state, duration=...)``. Steady states and exits are refused with a `NoSectionError`.

    Parameters
    ----------
    amplitude : float
        f, in m s⁻².
    start_frequency : float
        ω_0, in rad s⁻¹, not negative.
    end_frequency : float
        ω_1, in rad s⁻¹, not negative.
    duration : float
        D, in s, positive.
    phase : float
        φ, in rad.
    """

    amplitude: float = parameter("f", "m s^-2")
    start_frequency: float = parameter("omega_0", "rad s^-1", minimum=0)
    end_frequency: float = parameter("omega_1", "rad s^-1", minimum=0)
    duration: float = parameter("D", "s", above=0)
    phase: float = parameter("phi", "rad", default=0.0)

    def force(self, t: Any) -> Any:
        """Force at time t: f cos(φ + ω_0 t + (ω_1 − ω_0) t²/(2D)) from t = 0 to D."""
        change = (self.end_frequency - self.start_frequency) / (2 * self.duration)
        wave = self.amplitude * cos(self.phase + self.start_frequency * t + change * t**2)
        return Piecewise((wave, And(t >= 0, t <= self.duration)), (0, True))

    @property
    def period(self) -> float:
        """Infinity: the force never repeats."""
        return math.inf
