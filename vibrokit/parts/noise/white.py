"""White noise."""

from __future__ import annotations

from typing import Any

from vibrokit.parts.noise.noise_model import NoiseModel


class WhiteNoise(NoiseModel):
    """Gaussian white noise ξ on the velocity, ⟨ξ(t) ξ(t+τ)⟩ = D δ(τ).

    Parameters
    ----------
    intensity : float
        D, in m² s⁻³, not negative.
    """

    def amplitude(self, x: Any, v: Any) -> Any:
        """Factor before √D dW: 1 everywhere."""
        return 1
