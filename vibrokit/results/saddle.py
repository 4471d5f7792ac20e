"""Saddle: an unstable orbit; Manifold: one branch of its stable or unstable manifold, as a curve on the section."""

from __future__ import annotations

import dataclasses
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from vibrokit.documented import documented
from vibrokit.errors import counted
from vibrokit.results.attractor import Array, Attractor, Complex
from vibrokit.results.basins import NOT_FOLLOWED
from vibrokit.results.codes import Sentenced
from vibrokit.results.fields import PLANE, STATE, Length, Series, Vectors, Whole, Word
from vibrokit.results.table import fields_of

_AS = fields_of(Attractor)
_KIND = Word(
    '"saddle"; "flip saddle", if its unstable multiplier is negative; "repeller", without a stable direction; '
    '"chaotic" for a chaotic set on the boundary',
    known=("saddle", "flip saddle", "repeller", "chaotic"),
)
_NODES = Vectors(
    "states along the orbit at equal times, the first point first: one where motion from it comes back; more where it "
    "is so unstable that rounding errors carry motion away within its duration; none of a chaotic set",
    length=Length("node", "nodes along the orbit"), columns=STATE,
)  # fmt: skip
_LEADS_TO = Series(
    "labels of the attractors that the two unstable branches reach, then of others that a branch reaches that winds "
    "between basins; of a chaotic set, of the two basins between which it was found; negative as in basin",
    length=Length("side", "sides"), low=NOT_FOLLOWED, listed=True,
)  # fmt: skip


@documented
@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Saddle:
    """An unstable orbit; on the boundary of two basins, where its branches lead to different attractors.

    Residual and error are in units of the scene's motions: a length, and ω_n times it.
    """

    kind: Annotated[str, _KIND]
    period: Annotated[int, "period in forcing periods; 0 for a chaotic set, 1 at rest and for a limit cycle"]
    duration: Annotated[float, "time after which the motion repeats; 0 at rest, NaN for a chaotic set", "s"]
    points: Annotated[Array, _AS["points"]]
    nodes: Annotated[Array, _NODES]
    multipliers: Annotated[Complex, _AS["multipliers"]]
    exponents: Annotated[Complex, _AS["exponents"]]
    leads_to: Annotated[tuple[int, ...], _LEADS_TO]
    residual: Annotated[float, "distance between the nodes and the images of those before them; NaN for a chaotic set"]
    error: Annotated[float, "change of the first point when the integration is tightened; NaN for a chaotic set"]
    embedded: Annotated[bool, "whether the orbit lies inside a chaotic set that is a saddle of its own"] = False
    orbit: Annotated[Array, _AS["orbit"]] = dataclasses.field(default_factory=lambda: np.empty((0, 2)))

    @property
    def on_boundary(self) -> bool:
        """Whether its branches lead to different attractors."""
        return len(set(self.leads_to)) > 1

    @property
    def displacement(self) -> float:
        """About how far its points lie from the exact orbit, in units of the scene's motions; NaN for a chaotic set.

        Motion beside an orbit grows from node to node, and the residual with it.
        """
        growth = float(np.abs(self.multipliers).max(initial=1.0))
        return float(self.residual / growth ** (1.0 / max(1, len(self.nodes))))

    @property
    def at_equal_times(self) -> NDArray[np.float64]:
        """Its nodes, or its points if these are more."""
        return max(self.nodes, self.points, key=len)

    def __repr__(self) -> str:
        points = counted(len(self.points), "point")
        return f"Saddle: {self.kind}, period {self.period}, {points}, leads to {self.leads_to}"


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
