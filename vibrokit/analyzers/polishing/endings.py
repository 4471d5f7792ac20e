"""Endings on a face and at a saddle."""

from __future__ import annotations

import dataclasses
import math
from typing import Self

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.path_ends import AtFace, PathEnd
from vibrokit.analyzers.paths.action_descent import Closing
from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.polishing.ending import Cut, Ending, ResampledCandidate
from vibrokit.analyzers.polishing.linearized_orbit import LinearizedOrbit
from vibrokit.results.energy import ExitPath

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
        """End on the face, at the time of the first state beyond it or of the nearest one, and up to half a period off.

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
        shifts = sorted(range(max(-half, 1 - count), half), key=abs)
        return [self._cut(candidate, count, shift, last) for shift in shifts]

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
            rate, short = self.propagator.rate(point, time), 1e-4 * self.propagator.piece
            gradient = np.concatenate([-rate[n:], rate[:n]]) * scale / self._energy(scale)
            change = self._hamiltonian(point, time + short) - self._hamiltonian(point, time - short)
            in_point = np.vstack([in_point, gradient])
            in_time = np.vstack([in_time, [[change / (2 * short) / self._energy(scale)]]])
        return in_point, in_time

    def moved_to(self, end: PathEnd) -> Self:
        assert isinstance(end, AtFace)
        return dataclasses.replace(self, face=end)

    def displaced(self, point: Array, end: PathEnd) -> float:
        return float(point[self.propagator.size + self.face.axis]) * (self.moved_to(end).face.level - self.face.level)

    @property
    def free_time(self) -> bool:
        return not self.propagator.osc.autonomous

    @property
    def free(self) -> NDArray[np.bool_]:
        return np.arange(self.propagator.size) > 1 if self.face.axis == 0 else np.arange(self.propagator.size) != 1

    def crossing(self, path: ExitPath) -> int | None:
        rounding = 1e-9 * float(np.ptp(path.q[:, self.face.axis]))
        outside = np.flatnonzero(self._gaps(path.q[:-1]) < -rounding)
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
        return self.propagator.osc.reference_frequency * float(scale[:n] @ scale[n:])

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
        momenta = candidate.momenta_of(len(states), len(states) + len(straight) + 1)
        return Cut(np.concatenate([states, straight, end[None]]), self, last, momenta)


@dataclasses.dataclass(frozen=True, eq=False)
class SaddleEnding(Ending):
    """The last point lies in the stable space of an orbit."""

    orbit: LinearizedOrbit
    phase: int = 0  # of the last point, in pieces from node 0 of the orbit

    def distance(self, candidate: ResampledCandidate) -> float:
        return self._closest(candidate)[0]

    def cuts(self, candidate: ResampledCandidate) -> list[Cut]:
        """Cut where the candidate is closest to the orbit, and stay on it for four e-foldings, up to a section."""
        _, node, place = self._closest(candidate)
        (orbit, phase), pieces = self.orbit.starting(place), self.propagator.pieces
        periods = math.ceil(4.0 / (orbit.slowest_rate * pieces))
        added = min(max(2, periods), 40) * pieces + -node % self.propagator.grain
        states = np.concatenate([candidate.all_states[: node + 1], orbit.along(phase + 1, added)])
        ending = dataclasses.replace(self, orbit=orbit, phase=phase + added)
        momenta = candidate.momenta_of(node + 1, len(states))
        return [Cut(states, ending, self.propagator.piece, momenta)]

    def misfit(self, point: Array, time: float, scale: Array) -> Array:
        return self.orbit.misfit(point, self.phase, scale, leaving=False)

    def derivatives(self, point: Array, time: float, scale: Array) -> tuple[Array, Array]:
        in_point = self.orbit.misfit_derivatives(point, self.phase, scale, leaving=False)
        return in_point, np.zeros((len(in_point), 0))

    def carried_by(self, propagator: SegmentPropagator) -> Self:
        return dataclasses.replace(self, propagator=propagator, orbit=self.orbit.again(propagator))

    def through(self, point: Array) -> Self:
        return dataclasses.replace(self, orbit=self.orbit.through(point, self.phase, leaving=False))

    @property
    def approached(self) -> tuple[tuple[LinearizedOrbit, int], ...]:
        return ((self.orbit, self.phase),)

    @property
    def closing(self) -> Closing:
        n = self.propagator.size
        basis = self.orbit.space_at(self.phase, leaving=False)
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

    def _closest(self, candidate: ResampledCandidate) -> tuple[float, int, float]:
        """Distance, node of the candidate, and place on the orbit."""
        return self.orbit.closest(candidate.all_states, self.propagator.grain)
