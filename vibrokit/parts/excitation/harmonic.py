"""Harmonic excitation."""

from __future__ import annotations

import math
from typing import Any

from vibrokit.parts.excitation.excitation import Excitation
from vibrokit.parts.functions import cos
from vibrokit.parts.parameter import parameter


class Harmonic(Excitation):
    """Harmonic force: f cos(ω t + φ).

    Parameters
    ----------
    amplitude : float
        f, in m s⁻².
    frequency : float
        ω, in rad s⁻¹, positive.
    phase : float
        φ, in rad.
    """

    amplitude: float = parameter("f", "m s^-2")
    frequency: float = parameter("omega", "s^-1", above=0)
    phase: float = parameter("phi", "rad", default=0.0)

    def force(self, t: Any) -> Any:
        """Force at time t: f cos(ω t + φ)."""
        return self.amplitude * cos(self.frequency * t + self.phase)

    @property
    def period(self) -> float:
        """Period 2π/ω (s)."""
        return 2 * math.pi / self.frequency
