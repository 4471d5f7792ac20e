"""Parametric excitation: a property of the oscillator that varies in time."""

from __future__ import annotations

from typing import Any

from vibrokit.parts.excitation import Tone
from vibrokit.parts.functions import cos
from vibrokit.parts.parameter import parameter


class ParametricStiffness(Tone):
    """Stiffness that varies harmonically, as that of a gear mesh or of a parametron: force −κ cos(ωt + φ) x.

    It is added to the spring of the scene. With ω_n = 1, κ = −λ and ω = 2, a scene is
    x″ + 2ζx′ + (1 − λ cos 2t) x = 0, whose rest loses its stability at λ = 4ζ for small ζ (A. H. Nayfeh and D. T. Mook,
    "Nonlinear Oscillations", 1979, chapter 5).

    Parameters
    ----------
    stiffness : float
        κ, amplitude of the variation, in s⁻².
    frequency : float
        ω, in rad s⁻¹, positive.
    phase : float
        φ, in rad.
    """

    stiffness: float = parameter("kappa", "s^-2")
    frequency: float = parameter("omega", "rad s^-1", above=0)
    phase: float = parameter("phi", "rad", default=0.0)

    def force(self, t: Any, x: Any, v: Any) -> Any:
        """Force at time t: −κ cos(ωt + φ) x."""
        return -self.stiffness * cos(self.frequency * t + self.phase) * x
