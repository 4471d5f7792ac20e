"""Manifold: one branch of a saddle's stable or unstable manifold, as a curve on the section."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray


@dataclasses.dataclass(frozen=True, eq=False)
class Manifold:
    """One branch of a manifold on the section.

    Attributes
    ----------
    saddle : int
        Which of the structure's saddles it belongs to.
    point : int
        From which of the saddle's points it starts.
    stable : bool
    side : int
        +1 or −1: along the eigenvector or against it.
    curve : array (count, 2)
        (x, v) along the branch, outwards from the saddle.
    status : str
        Why it ends, as a sentence.
    """

    saddle: int
    point: int
    stable: bool
    side: int
    curve: NDArray[np.float64]
    status: str

    @property
    def arc_length(self) -> float:
        """Length of the curve in the plane of x and v."""
        return float(np.linalg.norm(np.diff(self.curve, axis=0), axis=1).sum())
