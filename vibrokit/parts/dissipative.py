"""A dissipative contact law: spring and dash-pot."""

from __future__ import annotations

import math
from typing import Any, Self

from vibrokit.construction import called
from vibrokit.errors import ParameterError, shown
from vibrokit.parts.contact import ContactLaw
from vibrokit.parts.parameter import parameter
from vibrokit.parts.restitution import crossing, elastic, restitution


class KelvinVoigt(ContactLaw):
    """A spring and a dash-pot side by side: k δ + c δ′.

    The force jumps to c δ′ at first touch. The coefficient of restitution does not depend on the speed. The same
    dash-pot has two of them: a barrier that is not adhesive lets go of the mass where the force becomes 0, an adhesive
    one where the depth does.

    Parameters
    ----------
    stiffness : float
        k, in s⁻², not negative.
    damping : float
        c, in s⁻¹, not negative.
    """

    stiffness: float = parameter("k", "s^-2", minimum=0)
    damping: float = parameter("c", "s^-1", minimum=0, mass_power=1)

    def force(self, depth: Any, rate: Any) -> Any:
        """Force on the mass: k δ + c δ′."""
        return self.stiffness * depth + self.damping * rate

    @classmethod
    @called
    def from_restitution(cls, e: float, stiffness: float, adhesive: bool = False) -> Self:
        """Return the law with which a free mass comes back at `e` times its speed.

        Parameters
        ----------
        e : float
            Coefficient of restitution, in (0, 1].
        stiffness : float
            k, in s⁻², positive.
        adhesive : bool
            Whether the barrier that the law is for is adhesive.

        Raises
        ------
        ParameterError

        Examples
        --------
        >>> law = KelvinVoigt.from_restitution(0.75, stiffness=1e4)
        >>> round(law.damping, 4), round(law.rebound(), 4), round(law.rebound(adhesive=True), 4)
        (19.4316, 0.75, 0.7358)
        """
        owner = f"{cls.__name__}.from_restitution"
        if not isinstance(adhesive, bool):
            raise ParameterError(f"{owner}: adhesive must be True or False, got {shown(adhesive)}.")
        loss, k = abs(math.log(restitution(owner, e))), elastic(owner, cls._declared[0], stiffness)
        ratio = loss / math.hypot(math.pi, loss) if adhesive else _ratio_of_loss(loss)
        return cls(k, 2 * ratio * math.sqrt(k))

    @called
    def rebound(self, adhesive: bool = False) -> float:
        """Coefficient of restitution of a free mass; 0 if it does not come back."""
        self.check_settled("KelvinVoigt.rebound")
        if not self.stiffness:
            return 0.0
        ratio = self.damping / (2 * math.sqrt(self.stiffness))
        if adhesive:
            return math.exp(-math.pi * ratio / math.sqrt(1 - ratio**2)) if ratio < 1 else 0.0
        return math.exp(-_loss(ratio))


# With ζ = c/(2√k), δ″ + 2ζ√k δ′ + kδ = 0 leaves δ = 0 at exp(−πζ/√(1 − ζ²)) times the speed at which it came, if
# ζ < 1; and 2ζ√k δ′ + kδ = 0 at exp(−2ζ acos ζ/√(1 − ζ²)) times that, which for ζ > 1 is exp(−2ζ acosh ζ/√(ζ² − 1)).
# The second is that of Schwager and Pöschel, *Granular Matter* 9 (2007) 465, with acos ζ in place of an arc tangent.


def _loss(ratio: float) -> float:
    """−ln e of a barrier that is not adhesive, for the damping ratio ζ; it rises without bound."""
    if ratio < 1:
        return 2 * ratio * math.acos(ratio) / math.sqrt((1 - ratio) * (1 + ratio))
    return 2 * ratio * math.acosh(ratio) / (math.sqrt(ratio - 1) * math.sqrt(ratio + 1)) if ratio > 1 else 2.0


def _ratio_of_loss(loss: float) -> float:
    return crossing(lambda ratio: _loss(ratio) - loss, 0.0, math.cosh(loss / 2))
