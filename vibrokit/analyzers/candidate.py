"""Candidate: a guess of an exit path, before it is polished."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray


@dataclasses.dataclass(frozen=True, eq=False)
class Candidate:
    """A guessed exit path, at equal steps of time.

    Attributes
    ----------
    source : int
        Label of the attractor that it leaves.
    target : int
        Label of the attractor that its end leads to; negative where that is not known.
    times : array (count,)
        Times (s), the first on the section (a whole number of periods of the forcing).
    states : array (count, n)
        States at these times, from near the source to just beyond the exit.
    action : float
        What its finder prices it at (m² s⁻³).
    finder : str
        Who found it, as the result's table has it: ``"action plot"``, ``"graph"``.
    """

    source: int
    target: int
    times: NDArray[np.float64]
    states: NDArray[np.float64]
    action: float
    finder: str
