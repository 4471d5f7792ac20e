"""Noise with a correlation time."""

from __future__ import annotations

from typing import Any, ClassVar

from vibrokit.parts.noise import StationaryNoise
from vibrokit.parts.parameter import parameter


class ColouredNoise(StationaryNoise):
    """Ornstein–Uhlenbeck noise y, which is white noise through a low pass: y′ = −λ y + λ √D W′.

    Its correlation is ⟨y(t) y(t+τ)⟩ = ½ λ D exp(−λ|τ|), its one-sided density 2D λ²/(λ² + ω²). Much slower than 1/λ it
    acts as `WhiteNoise` of the same intensity.

    Source: Uhlenbeck and Ornstein, *Phys. Rev.* 36 (1930) 823.

    Parameters
    ----------
    intensity : float
        D, in m² s⁻³, not negative: half the one-sided density at low frequencies.
    rate : float
        λ, in rad s⁻¹, positive: where the density has fallen to half. 1/λ is the correlation time.
    """

    extra_states: ClassVar[tuple[str, ...]] = ("y",)

    rate: float = parameter("lambda", "rad s^-1", above=0)

    def amplitude(self, x: Any, v: Any) -> Any:
        """Factor before √D dW in y: λ."""
        return self.rate

    def force(self, *extra: Any) -> Any:
        """Force of the noise: y."""
        (y,) = extra
        return y

    def drift(self, x: Any, v: Any, *extra: Any) -> tuple[Any, ...]:
        """Rate of y without noise: −λ y."""
        (y,) = extra
        return (-self.rate * y,)

    def density(self, frequency: Any) -> Any:
        """One-sided density 2D λ²/(λ² + ω²) at an angular frequency ω."""
        return 2 * self.intensity * self.rate**2 / (self.rate**2 + frequency**2)
