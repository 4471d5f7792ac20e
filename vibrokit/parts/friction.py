"""Friction: a force against the velocity, besides the viscous damping of the scene."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, ClassVar

from vibrokit.parts.functions import exp, tanh
from vibrokit.parts.parameter import parameter
from vibrokit.parts.part import Part


class Friction(Part):
    """Friction force per unit mass, x″ = … − force(x, v). Abstract.

    The direction changes smoothly: within a width w of rest, dry friction is viscous with the coefficient f/w, and a
    mass that would stick creeps instead. A force that jumps with the velocity is refused when the equations are
    derived, because no stepper holds a mass that sticks.
    """

    variables: ClassVar[tuple[str, ...]] = ("x", "v")

    @abstractmethod
    def force(self, x: Any, v: Any) -> Any:
        """Force (m s⁻²) at displacement `x` (m) and velocity `v` (m s⁻¹), as a SymPy expression."""


class DryFriction(Friction):
    """Coulomb's friction in a smooth form: f tanh((v − u)/w).

    Parameters
    ----------
    magnitude : float
        f: friction coefficient times normal force, per unit mass, in m s⁻², not negative.
    width : float
        w: speed of sliding at which 76 % of f is reached, in m s⁻¹, positive. Take it well below the speeds of
        interest. A mass that should stick creeps at less than w, and steps are at most about w/f.
    belt : float
        u: velocity of the surface that the mass slides on, in m s⁻¹.
    """

    magnitude: float = parameter("f", "m s^-2", minimum=0)
    width: float = parameter("w", "m s^-1", above=0)
    belt: float = parameter("u", "m s^-1", default=0.0)

    def force(self, x: Any, v: Any) -> Any:
        """Force against the sliding: f tanh((v − u)/w)."""
        return self.magnitude * tanh((v - self.belt) / self.width)


class StribeckFriction(Friction):
    """Dry friction that falls with the speed of sliding s = v − u: (f + (f_s − f) exp(−(s/v_s)²)) tanh(s/w).

    Source: Armstrong-Hélouvry, Dupont and Canudas de Wit, *Automatica* 30 (1994) 1083.

    Parameters
    ----------
    magnitude : float
        f: force of fast sliding, per unit mass, in m s⁻², not negative.
    static : float
        f_s: force at the beginning of sliding, in m s⁻², not negative.
    decay : float
        v_s: speed of sliding at which 63 % of the fall is over, in m s⁻¹, positive.
    width : float
        w: as of `DryFriction`; take it well below v_s.
    belt : float
        u: velocity of the surface that the mass slides on, in m s⁻¹.
    """

    magnitude: float = parameter("f", "m s^-2", minimum=0)
    static: float = parameter("f_s", "m s^-2", minimum=0)
    decay: float = parameter("v_s", "m s^-1", above=0)
    width: float = parameter("w", "m s^-1", above=0)
    belt: float = parameter("u", "m s^-1", default=0.0)

    def force(self, x: Any, v: Any) -> Any:
        """Force against the sliding: (f + (f_s − f) exp(−(s/v_s)²)) tanh(s/w)."""
        sliding = v - self.belt
        fall = (self.static - self.magnitude) * exp(-((sliding / self.decay) ** 2))
        return (self.magnitude + fall) * tanh(sliding / self.width)
