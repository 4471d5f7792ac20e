"""ExtremalPath: a path that solves Hamilton's equations, with what shows how well."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.polishing.ending import Ending
from vibrokit.analyzers.polishing.linearized_orbit import LinearizedOrbit
from vibrokit.analyzers.polishing.tolerances import TOLERANCES

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class ExtremalPath:
    """A path that solves Hamilton's equations between an orbit and an ending."""

    source: LinearizedOrbit  # the orbit that it leaves
    first: int  # phase of the first node, in pieces from node 0 of that orbit
    ending: Ending
    points: Array  # (nodes, 2n): (q, p), a piece apart, except the last
    last: float  # duration of the last piece (s)
    slopes: Array  # (nodes − 1, 2n, 2n): derivatives of the pieces
    actions: Array  # (nodes − 1,): action of each piece
    # Where a piece ends at q and the next one begins at q + δ, a path without the jump costs p·δ more. With this the
    # action is stationary, so that misfits change it by their squares even along a family of paths.
    over_jumps: float
    residual: float  # largest misfit, relative to the size of what is matched
    # Without forcing H is constant along the path, so that one condition follows from the others, and a path between
    # two equilibria may be shifted in time. The time is fixed, and the path may jump at one node in the direction of
    # ∇H. The jump is as small as the errors of the linearized ends.
    slack: float  # of that jump, relative to the path's size
    scale: Array  # (2n,): that size
    flat: bool  # whether it is one of a family of paths, all of which solve the equations to the accepted misfit

    @property
    def action(self) -> float:
        """From the source on: the pieces, and the action of the linearized equations before and after them."""
        return self.head + float(np.sum(self.actions)) + self.over_jumps + self.ending.tail(self.points[-1])

    @property
    def head(self) -> float:
        """½ p δq at the first node."""
        n = self.points.shape[1] // 2
        offset = self.points[0] - self.source.point(self.first)
        return 0.5 * float(offset[n:] @ offset[:n])

    def accepted(self, farther: float = 1.0) -> float:
        """Return the misfit that is accepted of the path solved for again, from some times as far from its orbits.

        Where it is one of a family, no shift makes up for the error of the linearized equations at its ends, which is
        of the second order in their distance.
        """
        left = max(float(self.distances[0]), self.ending.distance_left(self.points[-1])) / self.extent
        return max(TOLERANCES.accepted, (farther * left) ** 2) if self.flat else TOLERANCES.accepted

    @property
    def distances(self) -> Array:
        """Distances in (x, v) from the source, node by node."""
        orbit = self.source.along(self.first, len(self.points))
        return np.asarray(np.linalg.norm(self.points[:, :2] - orbit[:, :2], axis=1))

    @property
    def extent(self) -> float:
        """Largest distance from the source in (x, v)."""
        return float(self.distances.max())
