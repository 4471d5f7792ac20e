"""ActivationEnergy: the least action of an exit, with bounds."""

from __future__ import annotations

import dataclasses
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from vibrokit.results.certificate import Certificate


class Bound(StrEnum):
    """What the bounds of an activation energy rest on."""

    CERTIFIED = "certified"
    """Upper: a certified path. Lower: the graph search found no cheaper path within its error estimate."""
    UPPER = "upper"
    """Upper: a path. Lower: what no search has excluded, 0 if nothing was."""
    ESTIMATE = "estimate"
    """Both are error estimates of a grid."""
    BRACKET = "bracket"
    """Upper: a path that starts inside a set. Lower: an error estimate of a grid."""
    CONFIDENCE = "confidence"
    """A 95 % confidence interval."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class ExitPath:
    """A path of least action, from an attractor to where it leaves the basin.

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

    def __repr__(self) -> str:
        return f"ExitPath: {len(self.t)} samples over {np.ptp(self.t):g} s, action {self.action[-1]:.6g} m² s⁻³"


@dataclasses.dataclass(frozen=True, eq=False)
class ActivationEnergy:
    """Activation energy ΔU of one exit; the mean exit time grows like exp(ΔU/D) as D → 0.

    Attributes
    ----------
    source, target : int
        Labels of the attractor that is left and of the one that is reached; −1 for an exit that is no attractor.
    value : float
        ΔU, in units of action (m² s⁻³).
    lower, upper : float
        Bounds of ΔU itself: a cheaper path that was not excluded lies within them.
    method : str
    bound : Bound
        What the bounds rest on.
    numerical_error : float
        Error of `value` as the action of its own path or as the value on its own grid (m² s⁻³). It says nothing of
        cheaper paths.
    residual : float
        Largest misfit of the path's equations, relative to the size of what is matched; NaN for a path that was not
        polished.
    path : ExitPath or None
    saddle : int
        Which of the structure's saddles the path ends on; −1 if it ends on no saddle.
    certificate : Certificate or None
        Evidence, where the path was polished.
    """

    source: int
    target: int
    value: float
    lower: float
    upper: float
    method: str
    bound: Bound
    numerical_error: float = float("nan")
    residual: float = float("nan")
    path: ExitPath | None = dataclasses.field(default=None, repr=False)
    saddle: int = -1
    certificate: Certificate | None = None
