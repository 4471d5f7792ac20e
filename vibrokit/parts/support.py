"""Motion of the support: the inertial force that the mass feels in the coordinate relative to the support.

Spring, damping and stops act between the mass and the support, so nothing else changes. The stops move with it. Where
they are fixed in space, x is absolute, and the support moves the foot of spring and damper.
"""

from __future__ import annotations

from typing import Any

from vibrokit.parts.excitation import Tone
from vibrokit.parts.functions import cos
from vibrokit.parts.parameter import parameter


class SupportMotion(Tone):
    """Support that moves as y = a cos(ω t + φ), stops with it: the force is −y″ = a ω² cos(ω t + φ).

    Parameters
    ----------
    amplitude : float
        a, in m.
    frequency : float
        ω, in rad s⁻¹, positive.
    phase : float
        φ, in rad.
    """

    amplitude: float = parameter("a", "m")
    frequency: float = parameter("omega", "rad s^-1", above=0)
    phase: float = parameter("phi", "rad", default=0.0)

    def force(self, t: Any) -> Any:
        """Force at time t: a ω² cos(ω t + φ)."""
        return self.amplitude * self.frequency**2 * cos(self.frequency * t + self.phase)


class SupportAcceleration(Tone):
    """Support with the acceleration y″ = A cos(ω t + φ), stops with it: the force is −A cos(ω t + φ).

    Parameters
    ----------
    amplitude : float
        A, in m s⁻².
    frequency : float
        ω, in rad s⁻¹, positive.
    phase : float
        φ, in rad.
    """

    amplitude: float = parameter("A", "m s^-2", mass_power=0)
    frequency: float = parameter("omega", "rad s^-1", above=0)
    phase: float = parameter("phi", "rad", default=0.0)

    def force(self, t: Any) -> Any:
        """Force at time t: −A cos(ω t + φ)."""
        return -self.amplitude * cos(self.frequency * t + self.phase)


class SpringSupportMotion(Tone):
    """Support of spring and damper that moves as y = a cos(ω t + φ), while the stops are fixed in space.

    The displacement x is absolute: spring and damping act on x − y and v − y′. With a linear spring the force is
    ω_n² y + 2ζω_n y′. Friction is not carried along.

    Parameters
    ----------
    amplitude : float
        a, in m.
    frequency : float
        ω, in rad s⁻¹, positive.
    phase : float
        φ, in rad.
    """

    amplitude: float = parameter("a", "m")
    frequency: float = parameter("omega", "rad s^-1", above=0)
    phase: float = parameter("phi", "rad", default=0.0)

    def force(self, t: Any) -> Any:
        """No force but that of spring and damper."""
        return 0

    def support(self, t: Any) -> Any:
        """Displacement at time t: a cos(ω t + φ)."""
        return self.amplitude * cos(self.frequency * t + self.phase)
