"""Springs: the restoring force at every displacement."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, ClassVar

from vibrokit.parts.formula_part import FormulaPart
from vibrokit.parts.parameter import parameter
from vibrokit.parts.part import Part


class Spring(Part):
    """Restoring force per unit mass, x″ = … − force(x, v). Abstract."""

    variables: ClassVar[tuple[str, ...]] = ("x", "v")

    @abstractmethod
    def force(self, x: Any, v: Any) -> Any:
        """Force (m s⁻²) at displacement `x` (m) and velocity `v` (m s⁻¹), as a SymPy expression.

        It must not jump in `v`, as dry friction does, which `DryFriction` has in a smooth form. Nor in `x`: there, a
        stop may have the jump at first touch. The derivation of the equations raises DerivationError otherwise.
        """


class LinearSpring(Spring):
    """Linear spring: κ x.

    A scene may give `stiffness` instead; use this one for a negative stiffness.

    Parameters
    ----------
    stiffness : float
        κ, in s⁻².
    """

    stiffness: float = parameter("kappa", "s^-2")

    def force(self, x: Any, v: Any) -> Any:
        """Restoring force: κ x."""
        return self.stiffness * x


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


class CustomSpring(FormulaPart, Spring):
    """Spring given as a formula in ``x`` and ``v``, nonlinear damping included.

    Motion ends at the poles of the formula and at the edges of its domain.

    Dry friction, ``f*sign(v)``, is refused; `DryFriction` has it in a smooth form.

    Parameters
    ----------
    formula : str
        Arithmetic, numbers, constants and the functions of `vibrokit.parts.formula`; it is never run as code.
    **constants : float
        Values of the other names in the formula.

    Examples
    --------
    >>> CustomSpring("x + e*x**5", e=0.2)
    CustomSpring(formula='x + e*x**5', e=0.2)
    """

    formula: str
    constants: tuple[tuple[str, Any], ...]

    def __init__(self, /, formula: str, **constants: float) -> None:
        self._read(formula, constants)

    def force(self, x: Any, v: Any) -> Any:
        """Restoring force: the formula."""
        return self._evaluate(x, v)
