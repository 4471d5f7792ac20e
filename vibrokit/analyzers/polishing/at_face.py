"""FaceEnding: paths that end on a face of a region in (x, v), reached for the first time."""

from __future__ import annotations

import dataclasses
from typing import Self

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.path_ends import AtFace
from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.polishing.ending import Cut, Ending, ResampledCandidate
from vibrokit.results.energy import ExitPath

_ROUNDING = 1e-9  # of a path's extent: samples this far beyond the face still count as inside
_SHORT = 1e-4  # of a piece: time over which ∂H/∂t is taken

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class FaceEnding(Ending):
    """The last point lies on a face, with no momentum along it: the least action to be anywhere on the face.

    With forcing, the time at which the face is reached is free, so that H = 0 there. Without forcing H = 0 along every
    path that leaves an equilibrium; it is not a condition. On a bound of x, H = p₁v, and v = 0 takes its place: the
    path turns around on the face.
    """

    face: AtFace

    def distance(self, candidate: ResampledCandidate) -> float:
        return max(0.0, float(self._gaps(candidate.candidate.states).min()))

    def cuts(self, candidate: ResampledCandidate) -> list[Cut]:
        """End on the face, at the time of the first state beyond it or of the nearest one, or up to half a period off.

        With forcing the time matters, and a candidate that comes too fast may have the wrong one.
        """
        given, piece = candidate.candidate, self.propagator.piece
        times, gaps = given.times - given.times[0], self._gaps(given.states)
        beyond = bool(np.any(gaps <= 0))
        first = int(np.argmax(gaps <= 0) if beyond else np.argmin(gaps))
        before = max(first - 1, 0)
        share = gaps[before] / (gaps[before] - gaps[first]) if first and beyond else 1.0
        reached = max(times[before] + share * (times[first] - times[before]), 0.5 * piece)
        count = max(1, round(reached / piece))
        if not self.free_time:
            return [self._cut(candidate, count, 0, piece)]
        last, half = reached - (count - 1) * piece, self.propagator.pieces // 2
        return [self._cut(candidate, count, shift, last) for shift in range(max(-half, 1 - count), half)]

    def misfit(self, point: Array, time: float, scale: Array) -> Array:
        goal = np.zeros_like(point)
        goal[self.face.axis] = self.face.level
        misfits = ((point - goal) / scale)[self._coordinates]
        if self._asks_hamiltonian:
            misfits = np.append(misfits, self._hamiltonian(point, time) / self._energy(scale))
        return misfits

    def derivatives(self, point: Array, time: float, scale: Array) -> tuple[Array, Array]:
        in_point, n = np.eye(len(point))[self._coordinates], self.propagator.size
        in_time = np.zeros((len(in_point), int(self.free_time)))
        if self._asks_hamiltonian:
            rate, short = self.propagator.rate(point, time), _SHORT * self.propagator.piece
            gradient = np.concatenate([-rate[n:], rate[:n]]) * scale / self._energy(scale)
            change = self._hamiltonian(point, time + short) - self._hamiltonian(point, time - short)
            in_point = np.vstack([in_point, gradient])
            in_time = np.vstack([in_time, [[change / (2 * short) / self._energy(scale)]]])
        return in_point, in_time

    def tightened(self, propagator: SegmentPropagator) -> Self:
        return dataclasses.replace(self, propagator=propagator)

    @property
    def free_time(self) -> bool:
        return not self.propagator.osc.autonomous

    @property
    def free(self) -> NDArray[np.bool_]:
        return np.arange(self.propagator.size) > 1 if self.face.axis == 0 else np.arange(self.propagator.size) != 1

    def crossing(self, path: ExitPath) -> int | None:
        outside = np.flatnonzero(self._gaps(path.q[:-1]) < -_ROUNDING * float(np.ptp(path.q[:, self.face.axis])))
        return int(outside[0]) if outside.size else None

    @property
    def _coordinates(self) -> list[int]:
        """Which of (q, p) are given."""
        n, axis = self.propagator.size, self.face.axis
        turns = [1] if self.free_time and axis == 0 else []
        return [axis, *turns, *(n + number for number in range(n) if number != axis)]

    @property
    def _asks_hamiltonian(self) -> bool:
        return self.free_time and self.face.axis != 0

    def _hamiltonian(self, point: Array, time: float) -> float:
        """H = ½ p·(q′ + b): q′ = b + a p is linear in p, and is b at p = 0."""
        n = self.propagator.size
        rest = np.concatenate([point[:n], np.zeros(n)])
        rates = self.propagator.rate(point, time)[:n] + self.propagator.rate(rest, time)[:n]
        return 0.5 * float(point[n:] @ rates)

    def _energy(self, scale: Array) -> float:
        """Size of H on a path of this size."""
        n = self.propagator.size
        return self.propagator.osc.natural_frequency * float(scale[:n] @ scale[n:])

    def _gaps(self, states: Array) -> Array:
        """How far states are from the face, negative beyond it."""
        return self.face.outward * (self.face.level - states[:, self.face.axis])

    def _cut(self, candidate: ResampledCandidate, count: int, shift: int, last: float) -> Cut:
        """The first `count` nodes, less some or and more that go straight to the face."""
        states = candidate.states[: count + min(shift, 0)]
        end = states[-1].copy()
        end[self.face.axis] = self.face.level
        if self.face.axis == 0:
            end[1] = 0.0
        shares = (1 + np.arange(max(shift, 0)))[:, None] / (1 + max(shift, 0))
        straight = states[-1] + shares * (end - states[-1])
        return Cut(np.concatenate([states, straight, end[None]]), self, last)
