"""SaddleEnding: paths that end in the stable space of an unstable orbit on the basin boundary."""

from __future__ import annotations

import dataclasses
import math
from typing import Self

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.paths.action_descent import Closing
from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.polishing.ending import Cut, Ending, ResampledCandidate
from vibrokit.analyzers.polishing.linearized_orbit import LinearizedOrbit, linearized_orbit, normals_of

_SETTLING = 4.0  # e-foldings at the saddle that are added to a cut candidate
_MOST_ADDED = 40  # section intervals

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class SaddleEnding(Ending):
    """The last point lies in the stable space of an orbit."""

    orbit: LinearizedOrbit
    phase: int = 0  # of the last point, in pieces from node 0 of the orbit

    def distance(self, candidate: ResampledCandidate) -> float:
        return self._closest(candidate)[0]

    def cuts(self, candidate: ResampledCandidate) -> list[Cut]:
        """Cut where the candidate, on the section, is closest to the orbit, and stay on the orbit from there."""
        _, node, phase = self._closest(candidate)
        pieces = self.propagator.pieces
        periods = math.ceil(_SETTLING / (self.orbit.slowest_rate * pieces))
        added = min(max(2, periods), _MOST_ADDED) * pieces
        states = np.concatenate([candidate.all_states[: node + 1], self.orbit.along(phase + 1, added)])
        return [Cut(states, dataclasses.replace(self, phase=phase + added), self.propagator.piece)]

    def misfit(self, point: Array, time: float, scale: Array) -> Array:
        return self._normals(scale) @ ((point - self._point) / scale)

    def derivatives(self, point: Array, time: float, scale: Array) -> tuple[Array, Array]:
        normals = self._normals(scale)
        return normals, np.zeros((len(normals), 0))

    def tightened(self, propagator: SegmentPropagator) -> Self:
        again = linearized_orbit(propagator, self.orbit.states[0], self.period_nodes // propagator.pieces)
        return dataclasses.replace(self, propagator=propagator, orbit=again)

    @property
    def period_nodes(self) -> int:
        return len(self.orbit.states)

    @property
    def closing(self) -> Closing:
        n = self.propagator.size
        basis = self.orbit.stable[self.orbit.node(self.phase)]
        form = -np.linalg.solve(basis[:n].T, basis[n:].T).T
        return self._point[:n], (form + form.T) / 2

    def tail(self, point: Array) -> float:
        """−½ p δq, of the linearized equations."""
        offset, n = point - self._point, len(point) // 2
        return -0.5 * float(offset[n:] @ offset[:n])

    def distance_left(self, point: Array) -> float:
        return float(np.linalg.norm((point - self._point)[:2]))

    def missing(self, points: Array, radius: float) -> int:
        return self.orbit.missing(points[::-1], self.phase, 1, radius, self.propagator.grain)

    def extended(self, points: Array, count: int) -> tuple[Array, Self]:
        more = self.orbit.continued(points[-1], self.phase, max(count, 0))
        points = np.concatenate([points[: len(points) + min(count, 0)], more])
        return points, dataclasses.replace(self, phase=self.phase + count)

    @property
    def _point(self) -> Array:
        return self.orbit.point(self.phase)

    def _normals(self, scale: Array) -> Array:
        return normals_of(self.orbit.stable[self.orbit.node(self.phase)], scale)

    def _closest(self, candidate: ResampledCandidate) -> tuple[float, int, int]:
        """Distance, node of the candidate, and phase of the orbit."""
        states, grain = candidate.all_states, self.propagator.grain
        nodes = np.arange(grain, len(states), grain)
        phases = np.arange(0, self.period_nodes, self.propagator.pieces)
        offsets = (states[nodes][:, None] - self.orbit.states[phases]) / self.propagator.units
        distances = np.linalg.norm(offsets, axis=2)
        distances = np.where(np.isfinite(distances), distances, np.inf)
        node, phase = np.unravel_index(int(np.argmin(distances)), distances.shape)
        return float(distances[node, phase]), int(nodes[node]), int(phases[phase])
