"""Ending: what a path must satisfy at its last point, and how a candidate is cut to end there."""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.path_ends import PathEnd
from vibrokit.analyzers.paths.action_descent import Closing
from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.polishing.linearized_orbit import LinearizedOrbit
from vibrokit.errors import StructureError
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.stopping import COMPLETED
from vibrokit.results.energy import ExitPath
from vibrokit.symbolic.flow_kind import Flow

_ROUNDING = 1e-6  # of a piece: difference of two times that are equal

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class ResampledCandidate:
    """A candidate at the nodes."""

    candidate: Candidate
    states: Array  # (nodes, n): a piece apart, the first on the section
    after: Array  # (more, n): the noise-free motion from the last node on, that node included
    momenta: Array | None = None  # (nodes, n), where they are known

    @cached_property
    def all_states(self) -> Array:
        """Nodes of the candidate and of the motion after it."""
        return np.concatenate([self.states, self.after[1:]])

    def momenta_of(self, kept: int, count: int) -> Array | None:
        """Return the momenta of the first nodes, 0 at those that follow, where they are known."""
        if self.momenta is None:
            return None
        momenta = self.momenta[:kept]
        return np.concatenate([momenta, np.zeros((count - len(momenta), self.states.shape[1]))])


@dataclasses.dataclass(frozen=True, eq=False)
class Cut:
    """A candidate that is cut to end where it must."""

    states: Array  # (nodes, n): a piece apart, except the last
    ending: Ending
    last: float  # duration of the last piece (s)
    momenta: Array | None = None  # (nodes, n), where they are known


@dataclasses.dataclass(frozen=True, eq=False)
class Ending(ABC):
    """Where an exit path must end: n conditions on its last point, and one more if the time of that is free. Abstract.

    The methods with a body answer for paths that take a finite time.
    """

    propagator: SegmentPropagator

    @abstractmethod
    def distance(self, candidate: ResampledCandidate) -> float:
        """Return how near a candidate, or the motion after it, comes; infinite if it never does."""

    @abstractmethod
    def cuts(self, candidate: ResampledCandidate) -> list[Cut]:
        """End a candidate there, in each of the ways that are worth trying; at the time nearest to its own first."""

    @abstractmethod
    def misfit(self, point: Array, time: float, scale: Array) -> Array:
        """Return the misfits of the last point (q, p), reached at a time since the section, relative to `scale`."""

    @abstractmethod
    def derivatives(self, point: Array, time: float, scale: Array) -> tuple[Array, Array]:
        """Return the derivatives of the misfits in the last point over `scale`, and in the time if that is free."""

    def carried_by(self, propagator: SegmentPropagator) -> Self:
        """Return the same ending, prepared with another propagator."""
        return dataclasses.replace(self, propagator=propagator)

    def through(self, point: Array) -> Self:
        """Return the ending at an orbit so shifted in time, if it may be, that it is nearest to a last point (2n,)."""
        return self

    def moved_to(self, end: PathEnd) -> Self:
        """Return the ending for the same end of a scene with another parameter."""
        return self

    def displaced(self, point: Array, end: PathEnd) -> float:
        """Return p·δq of a last point that follows the end to where it is with another parameter."""
        return 0.0

    @property
    def free_time(self) -> bool:
        """Whether the duration of the last piece is unknown."""
        return False

    @property
    def free(self) -> NDArray[np.bool_]:
        """Which coordinates of the last state a cut leaves free, shape (n,)."""
        return np.zeros(self.propagator.size, dtype=bool)

    @property
    def period_nodes(self) -> int:
        """Nodes in a period of the orbit that the path approaches; 0 if it ends after a finite time."""
        return sum(orbit.period_nodes for orbit, _ in self.approached)

    @property
    def approached(self) -> tuple[tuple[LinearizedOrbit, int], ...]:
        """The orbit that the path approaches, and its node at the last point; empty if it ends after a finite time."""
        return ()

    @property
    def closing(self) -> Closing | None:
        """Quadratic form of the action after the last point; None if the path ends there."""
        return None

    def tail(self, point: Array) -> float:
        """Return the action after the last point."""
        return 0.0

    def crossing(self, path: ExitPath) -> int | None:
        """Return the first sample before the end at which a path has left; None if it leaves at its end."""
        return None

    def distance_left(self, point: Array) -> float:
        """Return the distance in (x, v) from the last point to the orbit that is approached."""
        return 0.0

    def missing(self, points: Array, radius: float) -> int:
        """Return how many nodes to add for the path to end within a radius; negative: how many to drop."""
        return 0

    def extended(self, points: Array, count: int) -> tuple[Array, Self]:
        """Return the points with so many nodes more at the end (fewer, if negative), and their ending."""
        return points, self


def resampled(propagator: SegmentPropagator, candidate: Candidate) -> ResampledCandidate:
    """Bring a candidate to the nodes, and follow the noise-free motion from its end.

    Between the samples of a candidate, motion follows Hamilton's equations where momenta are known, and is free of
    noise otherwise. After its end it may pass a saddle within 32 section intervals. Raises StructureError if the
    candidate has no duration, or states that are not finite.
    """
    if not np.isfinite(candidate.states).all():
        raise StructureError("it has states that are not finite.")
    times, n = candidate.times - candidate.times[0], propagator.size
    momenta = candidate.momenta
    given = candidate.states if momenta is None else np.hstack([candidate.states, momenta])
    if len(times) < 2 or not times[-1] > 0:
        raise StructureError("it has only one state, so there is no path to polish.")
    nodes = int(np.ceil(times[-1] / propagator.piece - _ROUNDING))
    at = propagator.piece * np.arange(nodes + 1)
    before = np.searchsorted(times, at + _ROUNDING * propagator.piece, side="right") - 1
    points = np.array(
        [
            _carried(propagator, given[last], times[last], time - times[last])
            for time, last in zip(at, before, strict=True)
        ]
    )
    after = propagator.onward(points[-1, :n], nodes, 32 * propagator.pieces)
    return ResampledCandidate(candidate, points[:, :n], after, None if momenta is None else points[:, n:])


def _carried(propagator: SegmentPropagator, point: Array, start: float, duration: float) -> Array:
    """Carry q or (q, p), which stays where the stepper cannot carry it."""
    if duration <= _ROUNDING * propagator.piece:
        return point
    osc, begin, size = propagator.osc, start % propagator.osc.section_interval, len(point)
    flow, full = (Flow.STATE, point) if size == propagator.size else (Flow.HAMILTONIAN, np.append(point, 0.0))
    ended = run_ensemble(osc, flow, propagator.stepper, full[None], start_time=begin, interval=duration)
    return ended.states[0, :size] if ended.status[0] == COMPLETED else point
