"""Bifurcation: a value of a parameter at which a branch of steady states changes in kind."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

BIFURCATIONS = (
    "fold", "pitchfork or transcritical", "period doubling", "Neimark–Sacker", "Hopf", "grazing",
)  # fmt: skip


@dataclasses.dataclass(frozen=True, eq=False)
class Bifurcation:
    """A value of the parameter at which a branch of steady states changes in kind.

    Attributes
    ----------
    kind : str
        ``"fold"`` (the branch turns back), ``"pitchfork or transcritical"`` (another branch crosses it), ``"period
        doubling"``, ``"Neimark–Sacker"``, ``"Hopf"``, or ``"grazing"`` (one more turn of the orbit touches a stop, or
        leaves it or lets go of it, or an equilibrium does).
    value : float
        Of the parameter.
    error : float
        Change of the value when the integration is tightened; half the interval if it is only known to lie between
        two values; the distance of the nearest orbit if it can be approached from one side only.
    branch : int
    period : int
        Of the orbit, in forcing periods; 1 for an equilibrium or a limit cycle. For a period doubling, of the orbit
        that doubles.
    point : array (n,)
        A point of the orbit there, on the section.
    side : str
        For grazing, of the stop; empty for the others.
    """

    kind: str
    value: float
    error: float
    branch: int
    period: int
    point: NDArray[np.float64]
    side: str = ""

    def __str__(self) -> str:
        side = f" at the {self.side} stop" if self.side else ""
        return f"{self.kind}{side} of branch {self.branch} at {self.value:.8g} ± {self.error:.1g}"
