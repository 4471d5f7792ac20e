"""Hertz contact."""

from __future__ import annotations

from typing import Any

from vibrokit.parts.contact.contact_law import ContactLaw
from vibrokit.parts.functions import Rational
from vibrokit.parts.parameter import parameter


class Hertz(ContactLaw):
    """Hertz's law for elastic bodies with curved surfaces: k δ^(3/2).

    Parameters
    ----------
    stiffness : float
        k, in m^(−1/2) s⁻², not negative.
    """

    stiffness: float = parameter("k", "m^(-1/2) s^-2", minimum=0)

    def force(self, depth: Any, rate: Any) -> Any:
        """Force on the mass: k δ^(3/2)."""
        return self.stiffness * depth ** Rational(3, 2)
