"""Candidate: a guess of an exit path, before it is polished; and when two paths cost the same."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

POLISHED = 1e-6
"""Relative difference of the actions, and of the places, of one path or orbit that was solved for twice."""


@dataclasses.dataclass(frozen=True, eq=False)
class Candidate:
    """A guess of an exit path, sampled at equal steps of time."""

    source: int  # label of the attractor that it leaves
    target: int  # label of the attractor that is reached from its end; negative where that is unknown
    times: NDArray[np.float64]  # (count,): times (s), the first on the section (a whole number of forcing periods)
    states: NDArray[np.float64]  # (count, n): states at these times, from near the source to just beyond the exit
    action: float  # action according to the method that found it (m² s⁻³)
    finder: str  # that method, in words
    momenta: NDArray[np.float64] | None = None  # (count, n): at the states, where the method knows them


def same_action(one: float, other: float, within: float = POLISHED) -> bool:
    """Return whether two actions differ by no more than a part of the first."""
    return abs(one - other) <= within * one
