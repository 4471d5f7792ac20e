"""Hunt and Crossley's contact law."""

from __future__ import annotations

from typing import Any, Self

from vibrokit.construction import called
from vibrokit.parts.contact import ContactLaw
from vibrokit.parts.functions import Rational
from vibrokit.parts.parameter import parameter
from vibrokit.parts.restitution import damping_of_rebound, elastic, impact_speed, rebound_of_damping, restitution


class HuntCrossley(ContactLaw):
    """Hunt and Crossley's dissipative contact: k δ^n (1 + 3/2 c δ′).

    The force is continuous at first touch. A free mass that comes at speed v leaves with the restitution e of
    (1 + a)/(1 − a e) = exp(a (1 + e)), a = 3/2 c v, whatever k and n are; for a slow one e ≈ 1 − c v.
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

    @classmethod
    @called
    def from_restitution(cls, e: float, stiffness: float, speed: float, exponent: float = 1.5) -> Self:
        """Return the law with which a free mass that comes at `speed` leaves at `e` times that.

        Parameters
        ----------
        e : float
            Coefficient of restitution, in (0, 1]. A slower mass has a larger one, a faster mass a smaller one.
        stiffness, exponent : float
            k, positive, and n, as of the class.
        speed : float
            Speed of impact (m s⁻¹), positive.

        Raises
        ------
        ParameterError
        """
        owner = f"{cls.__name__}.from_restitution"
        damping = damping_of_rebound(restitution(owner, e)) / (1.5 * impact_speed(owner, speed))
        return cls(elastic(owner, cls._declared[0], stiffness), damping, exponent)

    @called
    def rebound(self, speed: float) -> float:
        """Coefficient of restitution of a free mass that comes at `speed` (m s⁻¹); 0 if it does not come back."""
        damping = 1.5 * self.dissipation * impact_speed(f"{type(self).__name__}.rebound", speed)
        return rebound_of_damping(damping) if self.stiffness else 0.0
