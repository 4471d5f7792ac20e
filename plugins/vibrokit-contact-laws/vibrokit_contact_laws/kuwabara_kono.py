"""Kuwabara and Kono's contact law of viscoelastic spheres."""

from __future__ import annotations

import math
from typing import Any, Self

from vibrokit.construction import called
from vibrokit.parts.contact import ContactLaw
from vibrokit.parts.functions import Rational, sqrt
from vibrokit.parts.parameter import parameter
from vibrokit.parts.restitution import elastic, impact_speed, restitution


class KuwabaraKono(ContactLaw):
    """Two viscoelastic spheres, or a sphere and a plane: k δ^(3/2) + c √δ δ′.

    The restitution of a free mass that comes at speed v depends on b = c v^(1/5)/k^(3/5) alone. For small b it is
    1 − 1.15345 b + 0.79827 b² − …; for large b it tends to (3/2)^(2/3) b^(−5/3). It holds for a barrier that is not
    adhesive, which lets go where the force becomes 0. The slope of the force is infinite at first touch, so exit paths
    that touch such a stop are not certified.

    Parameters
    ----------
    stiffness : float
        k, in m^(−1/2) s⁻², not negative.
    dissipation : float
        c, in m^(−1/2) s⁻¹, not negative.

    References
    ----------
    G. Kuwabara and K. Kono, "Restitution coefficient in a collision between two spheres", *Japanese Journal of Applied
    Physics* 26 (1987) 1230–1233. The series: R. Ramírez, T. Pöschel, N. V. Brilliantov and T. Schwager, *Physical
    Review E* 60 (1999) 4465–4472. Leaving where the force becomes 0: T. Schwager and T. Pöschel, *Physical Review E* 78
    (2008) 051304. None was read in the original; the numbers were derived anew.
    """

    stiffness: float = parameter("k", "m^(-1/2) s^-2", minimum=0)
    dissipation: float = parameter("c", "m^(-1/2) s^-1", minimum=0, mass_power=1)

    def force(self, depth: Any, rate: Any) -> Any:
        """Force on the mass: k δ^(3/2) + c √δ δ′."""
        return self.stiffness * depth ** Rational(3, 2) + self.dissipation * sqrt(depth) * rate

    @classmethod
    @called
    def from_restitution(cls, e: float, stiffness: float, speed: float) -> Self:
        """Return the law with which a free mass that comes at `speed` leaves at `e` times that.

        Parameters
        ----------
        e : float
            Coefficient of restitution, in (0, 1].
        stiffness : float
            k, positive.
        speed : float
            Speed of impact (m s⁻¹), positive.

        Raises
        ------
        ParameterError
        """
        owner = f"{cls.__name__}.from_restitution"
        damping = damping_of_rebound(restitution(owner, e))
        k, v = elastic(owner, cls._declared[0], stiffness), impact_speed(owner, speed)
        return cls(k, damping * k**0.6 / v**0.2)

    @called
    def rebound(self, speed: float) -> float:
        """Coefficient of restitution of a free mass that comes at `speed` (m s⁻¹); 0 if it does not come back."""
        self.check_settled("KuwabaraKono.rebound")
        v = impact_speed(f"{type(self).__name__}.rebound", speed)
        return rebound_of_damping(self.dissipation * v**0.2 / self.stiffness**0.6) if self.stiffness else 0.0


# In units of speed v and length (v²/k)^(2/5), x″ = −√x (x + b x′). With z = √x, u = x′ and dt = z dθ there is no root
# left: dz/dθ = u/2, du/dθ = −z² (z² + b u).

_DIGITS = 1e-13


def rebound_of_damping(b: float) -> float:
    """Return the restitution −u where z² + b u = 0 again, by integration."""
    from scipy.integrate import solve_ivp

    def rates(_: float, state: Any) -> tuple[float, float]:
        z, u = state
        return u / 2, -(z**2) * (z**2 + b * u)

    def push(angle: float, state: Any) -> float:
        z, u = state
        return z * abs(z) + b * u if angle else 1.0  # for b = 0 as well it changes its sign at the end

    push.terminal = True  # type: ignore[attr-defined] # as solve_ivp takes events
    # For large b the mass goes in by z ≈ (3/2/b)^(1/3), and leaves at (3/2)^(2/3) b^(−5/3).
    scale = max(b, 1.0)
    small = (_DIGITS * scale ** (-1 / 3), _DIGITS * scale ** (-5 / 3))
    path = solve_ivp(rates, (0.0, 100.0), (0.0, 1.0), "DOP853", events=push, rtol=_DIGITS, atol=small)
    return float(-path.y_events[0][0][1])


def damping_of_rebound(e: float) -> float:
    """Return b of the restitution e, in (0, 1]."""
    from scipy.optimize import brentq

    low = (1 - e) / FIRST_COEFFICIENT
    if low < _DIGITS:  # nearer to 1 than the integration goes, where the series is exact
        return low
    # y = 2/3 z³ is at most 1/b, for u = 1 − b y − …, so that −u = z²/b is at most (3/2)^(2/3) b^(−5/3) at the end.
    ends = math.log(low / 2), math.log(2 * 1.5**0.4 / e**0.6)
    return math.exp(brentq(lambda log: math.log(rebound_of_damping(math.exp(log)) / e), *ends, xtol=_DIGITS))


FIRST_COEFFICIENT = 0.8 * 1.25**0.6 * math.gamma(0.6) * math.gamma(1.5) / math.gamma(2.1)
"""C = 4/5 (5/4)^(3/5) B(3/5, 3/2) of 1 − e ≈ C b: the integral of √x |x′| dx along an elastic impact, 1.15345."""
