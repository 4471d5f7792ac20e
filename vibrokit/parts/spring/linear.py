"""Linear spring."""

from __future__ import annotations

from typing import Any

from vibrokit.parts.parameter import parameter
from vibrokit.parts.spring.spring import Spring


class LinearSpring(Spring):
    """Linear spring: κ x.

    A scene without a spring has ω_n² x; use this one to set stiffness and damping independently.

    Parameters
    ----------
    stiffness : float
        κ, in s⁻².
    """

    stiffness: float = parameter("kappa", "s^-2")

    def force(self, x: Any, v: Any) -> Any:
        """Restoring force: κ x."""
        return self.stiffness * x
