"""Hunt and Crossley's contact law."""

from __future__ import annotations

from typing import Any

from vibrokit.parts.contact import ContactLaw
from vibrokit.parts.functions import Rational
from vibrokit.parts.parameter import parameter


class HuntCrossley(ContactLaw):
    """Hunt and Crossley's dissipative contact: k δ^n (1 + 3/2 c δ′).

    The force is continuous at first touch, and a slow bounce at speed v ends with the restitution e ≈ 1 − c v.
    Where the mass leaves so fast that the law would pull, the barrier lets go of it.

    Parameters
    ----------
    stiffness : float
        k, in m^(1−n) s⁻², not negative.
    dissipation : float
        c, in s m⁻¹, not negative.
    exponent : float
        n, positive; 3/2 for elastic bodies with curved surfaces. Structural: another exponent is other code.

    References
    ----------
    K. H. Hunt and F. R. E. Crossley, "Coefficient of restitution interpreted as damping in vibroimpact",
    *Journal of Applied Mechanics* 42 (1975) 440–445.
    """

    stiffness: float = parameter("k", "m^(1-n) s^-2", minimum=0)
    dissipation: float = parameter("c", "s m^-1", minimum=0)
    exponent: float = parameter("n", "", above=0, structural=True, default=1.5)

    def force(self, depth: Any, rate: Any) -> Any:
        """Push on the mass: k δ^n (1 + 3/2 c δ′)."""
        return self.stiffness * depth**self.exponent * (1 + Rational(3, 2) * self.dissipation * rate)
