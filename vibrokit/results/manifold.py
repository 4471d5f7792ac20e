"""Manifold: one branch of a saddle's stable or unstable manifold, as a curve on the section."""

from __future__ import annotations

import dataclasses
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from vibrokit.documented import documented
from vibrokit.errors import counted
from vibrokit.results.fields import PLANE, Length, Vectors, Whole
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


_CURVE = Vectors(
    "(x, v) along the branch, outwards from the saddle",
    length=Length("vertex", "vertices", ragged=True), columns=PLANE, prefixed=False,
)  # fmt: skip


@documented
@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Manifold:
    """One branch of a manifold on the section."""

    saddle: Annotated[int, "place of its saddle among those of the structure"]
    point: Annotated[int, "point of the saddle from which the branch starts"]
    stable: Annotated[bool, "whether the branch belongs to the stable manifold"]
    side: Annotated[int, Whole("along the eigenvector (1) or against it (-1)", low=-1, high=1)]
    curve: Annotated[NDArray[np.float64], _CURVE]
    end: Annotated[ManifoldEnd, "why the branch ends"]

    @property
    def arc_length(self) -> float:
        """Length of the curve in the plane of x and v."""
        return float(np.linalg.norm(np.diff(self.curve, axis=0), axis=1).sum())

    def __repr__(self) -> str:
        kind = "stable" if self.stable else "unstable"
        vertices = counted(len(self.curve), "vertex", "vertices")
        return f"Manifold: {kind} branch of saddle {self.saddle}, {vertices}, ends: {self.end}"
