"""Manifold: one branch of a saddle's stable or unstable manifold, as a curve on the section."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import counted
from vibrokit.results.sentenced import Sentenced


class ManifoldEnd(Sentenced):
    """Why a branch ends at the last point of its curve; each has a sentence."""

    LEAVES_REGION = "leaves-region", "The branch leaves the region, widened by its own size on every side."
    AT_REST = "at-rest", "The branch converges to a point."
    ARC_LENGTH = "arc-length", "The branch reaches its arc length."
    MOST_VERTICES = "most-vertices", "The branch has as many vertices as are kept; give a larger spacing or bend."
    MOST_SECTIONS = "most-sections", "Growing the branch took as many sections as it may; grow it alone for more."
    TOO_SLOW = "too-slow", "The branch grows too slowly."
    SADDLE_OUTSIDE = "saddle-outside", "The saddle lies outside the region, widened by its own size on every side."
    TOO_EXTREME = "too-extreme", "The multiplier of the saddle is too extreme to follow the branch over one period."


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Manifold:
    """One branch of a manifold on the section.

    Attributes
    ----------
    saddle : int
        Place of its saddle among those of the structure.
    point : int
        Which of the saddle's points it starts from.
    stable : bool
    side : int
        +1 or −1: along the eigenvector or against it.
    curve : array (count, 2)
        (x, v) along the branch, outwards from the saddle.
    end : ManifoldEnd
        Why it ends.
    """

    saddle: int
    point: int
    stable: bool
    side: int
    curve: NDArray[np.float64]
    end: ManifoldEnd

    @property
    def arc_length(self) -> float:
        """Length of the curve in the plane of x and v."""
        return float(np.linalg.norm(np.diff(self.curve, axis=0), axis=1).sum())

    def __repr__(self) -> str:
        kind = "stable" if self.stable else "unstable"
        vertices = counted(len(self.curve), "vertex", "vertices")
        return f"Manifold: {kind} branch of saddle {self.saddle}, {vertices}, ends: {self.end}"
