"""Constant excitation."""

from __future__ import annotations

from typing import Any

from vibrokit.parts.excitation.excitation import Excitation
from vibrokit.parts.parameter import parameter


class Constant(Excitation):
    """Constant force f.

    Parameters
    ----------
    force : float
        f, in m s⁻².
    """

    magnitude: float = parameter("f", "m s^-2", name="force")

    def __init__(self, force: float) -> None:
        object.__setattr__(self, "magnitude", force)
        self.__post_init__()

    def force(self, t: Any) -> Any:
        """Force at any time: f."""
        return self.magnitude

    @property
    def period(self) -> None:
        """None: a constant force has no period."""
        return None
