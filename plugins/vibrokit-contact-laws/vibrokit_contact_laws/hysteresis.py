"""What the published laws share: hysteresis damping that is set by a nominal coefficient of restitution."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, Self

from vibrokit.construction import called
from vibrokit.errors import ParameterError
from vibrokit.parts.contact import ContactLaw
from vibrokit.parts.parameter import parameter
from vibrokit.parts.restitution import (
    crossing,
    damping_of_rebound,
    elastic,
    impact_speed,
    rebound_of_damping,
    restitution,
)


class HysteresisLaw(ContactLaw):
    """A contact law k δ^n (1 + a(e) δ′/v), with a factor a that depends on the nominal restitution e. Abstract.

    The nominal e and speed v are parameters. A law knows depth and rate, and cannot know the speed of the impact that
    it is in. `rebound` is the restitution that a free mass really has.

    Parameters
    ----------
    stiffness : float
        k, in m^(1−n) s⁻², not negative.
    restitution : float
        e, nominal, in (0, 1].
    speed : float
        v, nominal speed of impact, in m s⁻¹, positive.
    exponent : float
        n, positive; 3/2 for elastic bodies with curved surfaces. Structural: another exponent is other code.

    For developers
    --------------
    Write `factor`, which falls to 0 at e = 1.
    """

    stiffness: float = parameter("k", "m^(1-n) s^-2", minimum=0)
    restitution: float = parameter("e", "", above=0, maximum=1)
    speed: float = parameter("v_0", "m s^-1", above=0)
    exponent: float = parameter("n", "", above=0, structural=True, default=1.5)

    @staticmethod
    @abstractmethod
    def factor(e: Any) -> Any:
        """Factor a of the damping for the nominal restitution, a number or a symbol."""

    def force(self, depth: Any, rate: Any) -> Any:
        """Push on the mass: k δ^n (1 + a(e) δ′/v)."""
        return self.stiffness * depth**self.exponent * (1 + self.factor(self.restitution) * rate / self.speed)

    @classmethod
    @called
    def from_restitution(cls, e: float, stiffness: float, speed: float, exponent: float = 1.5) -> Self:
        """Return the law with which a free mass that comes at `speed` really leaves at `e` times that.

        Its nominal restitution is another number, for most laws. All laws that are made in this way with the same
        arguments have the same force.

        Parameters
        ----------
        e : float
            Coefficient of restitution, in (0, 1].
        stiffness, exponent : float
            k, positive, and n, as of the class.
        speed : float
            Speed of impact (m s⁻¹), positive; the nominal one of the law as well.

        Raises
        ------
        ParameterError
            An argument is out of range, or no nominal restitution leads to an `e` as small as this.
        """
        owner = f"{cls.__name__}.from_restitution"
        needed, speed = damping_of_rebound(restitution(owner, e)), impact_speed(owner, speed)
        nominal = crossing(lambda nominal: needed - float(cls.factor(nominal)), 0.0, 1.0) if needed else 1.0
        if not nominal:  # the factor is nowhere as large as this
            least = rebound_of_damping(float(cls.factor(0.0)))
            raise ParameterError(
                f"{owner}: e must be greater than {least:.6g}, the restitution that this law tends to as its nominal "
                f"restitution tends to 0, got {e:g}."
            )
        return cls(elastic(owner, cls._declared[0], stiffness), nominal, speed, exponent)

    @called
    def rebound(self, speed: float | None = None) -> float:
        """Coefficient of restitution that a free mass really has.

        Parameters
        ----------
        speed : float, optional
            Speed of impact (m s⁻¹); the nominal one unless given.

        Returns
        -------
        float
            0 if the mass does not come back.
        """
        speed = self.speed if speed is None else impact_speed(f"{type(self).__name__}.rebound", speed)
        damping = float(self.factor(self.restitution)) * (speed / self.speed)
        return rebound_of_damping(damping) if self.stiffness else 0.0
