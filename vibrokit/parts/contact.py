"""Contact laws: the force of a stop."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, ClassVar

from vibrokit.parts.formula import evaluate
from vibrokit.parts.formula_part import FormulaPart
from vibrokit.parts.functions import Rational
from vibrokit.parts.parameter import parameter
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
        """Whether the force at depth 0 vanishes, at rates −1, 0 and 1; nothing for laws of the toolkit.

        The order of constants in a minimum or a maximum may decide it, so it is a part of what decides compiled code.
        For laws of the toolkit the signs of their parameters decide it.
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


class CustomLaw(FormulaPart, ContactLaw):
    """Contact law given as a formula in ``depth`` and ``rate``.

    Parameters
    ----------
    formula : str
        Arithmetic, numbers, constants and the functions of `vibrokit.parts.formula`; it is never run as code.
    **constants : float
        Values of the other names in the formula.

    Examples
    --------
    >>> CustomLaw("k*depth**1.5 + c*depth*rate", k=50.0, c=0.1)
    CustomLaw(formula='k*depth**1.5 + c*depth*rate', k=50.0, c=0.1)
    """

    formula: str
    constants: tuple[tuple[str, Any], ...]

    def __init__(self, /, formula: str, **constants: float) -> None:
        self._read(formula, constants)

    def touch(self) -> tuple[bool, ...]:
        """Whether the force at depth 0 vanishes, at rates −1, 0 and 1."""
        values = dict(self.constants)
        forces = (evaluate(self.formula, values | {"depth": 0.0, "rate": rate}) for rate in (-1.0, 0.0, 1.0))
        return tuple(force == 0 for force in forces)

    def force(self, depth: Any, rate: Any) -> Any:
        """Force on the mass: the formula."""
        return self._evaluate(depth, rate)
