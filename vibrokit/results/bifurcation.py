"""Bifurcation: a value of a parameter at which a branch of steady states changes in kind."""

from __future__ import annotations

import dataclasses
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from vibrokit.documented import documented
from vibrokit.results.fields import LARGEST, STATE, Length, Number, Vectors, Whole, Word

_KIND = Word(
    '"fold", where the branch turns back; "pitchfork or transcritical", where another branch crosses it; "period '
    'doubling", "Neimark–Sacker", "Hopf"; "grazing", where one more turn of the orbit touches a stop, leaves it or '
    "lets go of it, or an equilibrium does",
    known=("fold", "pitchfork or transcritical", "period doubling", "Neimark–Sacker", "Hopf", "grazing"),
)
_ERROR = Number(
    "change of the value when the integration is tightened; half the interval if it is only known to lie between two "
    "values; the distance of the nearest orbit if it can be approached from one side only",
    "", 0.0, LARGEST,
)  # fmt: skip
_POINT = Vectors("a point of the orbit there, on the section", length=Length("point", "points"), columns=STATE)
_SIDE = Word("side of the stop that is grazed; empty for other kinds", known=("", "left", "right"))


@documented
@dataclasses.dataclass(frozen=True, eq=False)
class Bifurcation:
    """A value of the parameter at which a branch of steady states changes in kind."""

    kind: Annotated[str, _KIND]
    value: Annotated[float, Number("value of the parameter", "", -LARGEST, LARGEST)]
    error: Annotated[float, _ERROR]
    branch: Annotated[int, "number of the branch"]
    period: Annotated[int, Whole("period in forcing periods, 1 for motion without them; before it doubles", low=1)]
    point: Annotated[NDArray[np.float64], _POINT]
    side: Annotated[str, _SIDE] = ""

    def __str__(self) -> str:
        side = f" at the {self.side} stop" if self.side else ""
        return f"{self.kind}{side} of branch {self.branch} at {self.value:.8g} ± {self.error:.1g}"
