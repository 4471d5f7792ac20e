"""Cubic spring."""

from __future__ import annotations

from typing import Any

from vibrokit.parts.parameter import parameter
from vibrokit.parts.spring.spring import Spring


class CubicSpring(Spring):
    """Duffing's spring: α x + β x³; a double well if α < 0 < β.

    Parameters
    ----------
    linear : float
        α, in s⁻².
    cubic : float
        β, in m⁻² s⁻².
    """

    linear: float = parameter("alpha", "s^-2")
    cubic: float = parameter("beta", "m^-2 s^-2")

    def force(self, x: Any, v: Any) -> Any:
        """Restoring force: α x + β x³."""
        return self.linear * x + self.cubic * x**3
