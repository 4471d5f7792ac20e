"""ActivationEnergy: how much action an exit costs."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from vibrokit.results.certificate import Certificate


@dataclasses.dataclass(frozen=True, eq=False)
class ExitPath:
    """A path of least action, from an attractor to where it left the basin.

    Attributes
    ----------
    t : array (count,)
        Times (s).
    q : array (count, n)
        State.
    p : array (count, n)
        Momenta.
    action : array (count,)
        Action S (m² s⁻³).
    section : int array
        Which of the samples lie on the section.
    """

    t: NDArray[np.float64]
    q: NDArray[np.float64]
    p: NDArray[np.float64]
    action: NDArray[np.float64]
    section: NDArray[np.int64]


@dataclasses.dataclass(frozen=True, eq=False)
class ActivationEnergy:
    """Activation energy ΔU of one exit; the mean exit time grows like exp(ΔU/D) as D → 0.

    Attributes
    ----------
    source, target : int
        Labels of the attractor that is left and of the one that is reached; −1 for a target that is none, as a touch.
    value : float
        ΔU, in units of action (m² s⁻³).
    lower, upper : float
        Bounds: numerical error where certified, 95 % interval where sampled.
    method : str
    residual : float
        Size of the momentum at the exit: 0 for a path that ends on the basin's boundary for good.
    path : ExitPath or None
    saddle : int
        Which of the structure's saddles the path ends on; −1 where it ends on none.
    certificate : Certificate or None
        Evidence, where the path was polished.
    """

    source: int
    target: int
    value: float
    lower: float
    upper: float
    method: str
    residual: float
    path: ExitPath | None = dataclasses.field(default=None, repr=False)
    saddle: int = -1
    certificate: Certificate | None = None

    @property
    def exit(self) -> str:
        """In words: from where to where."""
        return f"{self.source} → {self.target if self.target >= 0 else 'exit'}"
