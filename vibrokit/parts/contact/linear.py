"""Linear contact."""

from __future__ import annotations

from typing import Any

from vibrokit.parts.contact.contact_law import ContactLaw
from vibrokit.parts.parameter import parameter


class Linear(ContactLaw):
    """A linear spring as a stop: k δ.

    Parameters
    ----------
    stiffness : float
        k, in s⁻², not negative.
    """

    stiffness: float = parameter("k", "s^-2", minimum=0)

    def force(self, depth: Any, rate: Any) -> Any:
        """Force on the mass: k δ."""
        return self.stiffness * depth
