"""Candidate: a guess of an exit path, before it is polished."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray


@dataclasses.dataclass(frozen=True, eq=False)
class Candidate:
    """A guess of an exit path, sampled at equal steps of time.

    Attributes
    ----------
    source : int
        Label of the attractor that it leaves.
    target : int
        Label of the attractor that is reached from its end; negative where that is unknown.
    times : array (count,)
        Times (s), the first on the section (a whole number of forcing periods).
    states : array (count, n)
        States at these times, from near the source to just beyond the exit.
    action : float
        Action according to the method that found it (m² s⁻³).
    finder : str
        That method: ``"action plot"`` or ``"graph"``.
    """

    source: int
    target: int
    times: NDArray[np.float64]
    states: NDArray[np.float64]
    action: float
    finder: str
