"""ContactLaw: how hard a stop pushes back."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any

from vibrokit.parts.part import Part


class ContactLaw(Part):
    """Force of a stop on the mass, per unit mass, as a function of depth and rate.

    Abstract. Side, position and sign belong to `Barrier`, and so does "no force when apart": the formula is
    asked at positive depth only. Whether the law is conservative, how smooth it is at first touch, and whether
    its force jumps there, is derived from the formula.
    """

    @abstractmethod
    def force(self, depth: Any, rate: Any) -> Any:
        """Push on the mass (m s⁻²), positive when it pushes back.

        Parameters
        ----------
        depth : sympy.Symbol
            How far the mass has gone past the stop (m), positive.
        rate : sympy.Symbol
            Rate of depth (m s⁻¹), positive when going deeper.

        Returns
        -------
        sympy.Expr
        """
