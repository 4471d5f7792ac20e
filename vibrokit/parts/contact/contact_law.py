"""ContactLaw: the force of a stop."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, ClassVar

from vibrokit.parts.part import Part


class ContactLaw(Part):
    """Force of a stop on the mass, per unit mass, as a function of depth and rate. Abstract.

    `Barrier` holds side, position and sign, and sets the force to zero without contact; the formula is evaluated at
    positive depth only. Whether the law is conservative, how smooth it is at first touch, and whether its force jumps
    there, is derived from the formula. A force that jumps in the rate, or at another depth, is refused when the
    equations are derived.
    """

    variables: ClassVar[tuple[str, ...]] = ("depth", "rate")

    def touch(self) -> tuple[bool, ...]:
        """Whether the force at depth 0 vanishes, at rates −1, 0 and 1; nothing for laws that no value makes jump.

        The order of constants in a minimum or a maximum may decide it, so it is a part of what decides compiled code.
        """
        try:
            return () if self.is_ours() else tuple(bool(self.force(0.0, rate) == 0) for rate in (-1.0, 0.0, 1.0))
        except Exception:  # the formula is for symbols; the derivation checks it
            return ()

    @abstractmethod
    def force(self, depth: Any, rate: Any) -> Any:
        """Force on the mass (m s⁻²), positive if it pushes the mass back.

        Parameters
        ----------
        depth : sympy.Symbol
            Depth of the mass beyond the stop (m), positive.
        rate : sympy.Symbol
            Rate of change of depth (m s⁻¹), positive as depth increases.

        Returns
        -------
        sympy.Expr
        """
