"""Noise of a narrow band."""

from __future__ import annotations

from typing import Any, ClassVar

from vibrokit.parts.noise import StationaryNoise
from vibrokit.parts.parameter import parameter

_WIDEST = 0.5  # damping ratio: a peak as wide as its own frequency is none


class FilteredNoise(StationaryNoise):
    """White noise through a resonant band pass, y″ + 2ζω y′ + ω² y = 2ζω √D W″.

    The force y has the one-sided density 2D (2ζων)²/((ω² − ν²)² + (2ζων)²) at the angular frequency ν: 2D at the peak,
    which is at ω, half of that at a distance of about ζω, and 0 at ν = 0. Its variance is ζωD. The velocity of a
    resonator under white noise has this density, so that it is what a floor or a mount makes of a wide-band source.

    Parameters
    ----------
    intensity : float
        D, in m² s⁻³, not negative: half the one-sided density at the peak.
    frequency : float
        ω, in rad s⁻¹, positive: where the peak is.
    damping_ratio : float
        ζ, positive: half the width of the peak at half its height is ζω.
    """

    extra_states: ClassVar[tuple[str, ...]] = ("w", "y")

    frequency: float = parameter("omega", "rad s^-1", above=0)
    damping_ratio: float = parameter("zeta", "", above=0)

    def amplitude(self, x: Any, v: Any) -> Any:
        """Factor before √D dW in y: 2ζω."""
        return 2 * self.damping_ratio * self.frequency

    def force(self, *extra: Any) -> Any:
        """Force of the noise: y."""
        _, y = extra
        return y

    def drift(self, x: Any, v: Any, *extra: Any) -> tuple[Any, ...]:
        """Rates of w and of y without noise: ω y and −ω w − 2ζω y."""
        w, y = extra
        return (self.frequency * y, -self.frequency * (w + 2 * self.damping_ratio * y))

    def density(self, frequency: Any) -> Any:
        """One-sided density at an angular frequency."""
        passed = (2 * self.damping_ratio * self.frequency * frequency) ** 2
        return 2 * self.intensity * passed / ((self.frequency**2 - frequency**2) ** 2 + passed)

    def unresolved(self, resolution: float) -> str:
        """Return why a fit is no narrow band: no peak, or one narrower than the spectrum resolves."""
        width = 2 * self.damping_ratio * self.frequency
        if self.damping_ratio > _WIDEST:
            return (
                f"the spectrum has no peak: the best one is {width:.3g} rad/s wide; take ColouredNoise or WhiteNoise."
            )
        if width < resolution:
            return (
                f"the peak at {self.frequency:.4g} rad/s is {width:.2g} rad/s wide, and the record resolves "
                f"{resolution:.2g}; take one that is {resolution / width:.1f} times as long, or longer."
            )
        return ""
