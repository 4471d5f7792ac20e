"""Ending: what a path must satisfy at its last point, and how a candidate is cut to end there."""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from typing import Self

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.paths.action_descent import Closing
from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.polishing.resampled import ResampledCandidate
from vibrokit.results.energy import ExitPath

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class Cut:
    """A candidate that is cut to end where it must."""

    states: Array  # (nodes, n): a piece apart, except the last
    ending: Ending
    last: float  # duration of the last piece (s)


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
        """End a candidate there, in each of the ways that are worth trying."""

    @abstractmethod
    def misfit(self, point: Array, time: float, scale: Array) -> Array:
        """Return the misfits of the last point (q, p), reached at a time since the section, relative to `scale`."""

    @abstractmethod
    def derivatives(self, point: Array, time: float, scale: Array) -> tuple[Array, Array]:
        """Return the derivatives of the misfits in the last point over `scale`, and in the time if that is free."""

    @abstractmethod
    def tightened(self, propagator: SegmentPropagator) -> Self:
        """Return the same ending, prepared with a finer integration."""

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
        return 0

    @property
    def closing(self) -> Closing | None:
        """Quadratic form of the action after the last point; None if the path ends there."""
        return None

    def tail(self, point: Array) -> float:
        """Return the action after the last point."""
        return 0.0

    def crossing(self, path: ExitPath) -> int | None:
        """Return the first sample at which a path has already left, before its end; None if there is none."""
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
