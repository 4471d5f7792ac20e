"""Excitation: a force that depends on time only."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, ClassVar

from vibrokit.parts.part import Part


class Excitation(Part):
    """Force per unit mass that depends on time only. Abstract."""

    variables: ClassVar[tuple[str, ...]] = ("t",)

    @abstractmethod
    def force(self, t: Any) -> Any:
        """Force (m s⁻²) at time `t` (s), as a SymPy expression.

        It may jump, and have pulses as short as 1/30 000 of its period; one that never repeats is searched for pulses
        from t = 0 to 128 free oscillations.
        """

    @property
    @abstractmethod
    def period(self) -> float | None:
        """Period (s); None if the force is constant, `math.inf` if it varies without period."""
