"""Destinations: what a path is polished towards, and how a candidate is cut to end there."""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.polishing.carrier import Carrier
from vibrokit.analyzers.polishing.course import Course
from vibrokit.analyzers.polishing.endings import Ending
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.results.energy import ExitPath

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class Cut:
    """A candidate that ends where it shall.

    Attributes
    ----------
    states : array (nodes, n)
        A piece apart but for the last.
    ending : Ending
    last : float or None
        Length of the last piece (s); None for one like the others.
    """

    states: Array
    ending: Ending
    last: float | None = None


@dataclasses.dataclass(frozen=True, eq=False)
class Goal(ABC):
    """What an exit path shall end on. Abstract.

    Attributes
    ----------
    saddle : int
        Which of the structure's saddles; −1 if it ends on none.
    targets : tuple of int
        Labels of the attractors that it lets through to; −1 if that is not asked.
    """

    saddle: int
    targets: tuple[int, ...]

    @abstractmethod
    def scene(self, osc: Oscillator) -> Oscillator:
        """Return the scene in which the path is the same and easiest to follow."""

    @abstractmethod
    def reached(self, attractor: Attractor) -> bool:
        """Return whether an attractor is there already, without noise."""

    @abstractmethod
    def destination(self, carrier: Carrier) -> Destination:
        """Prepare it for polishing."""


class Destination(ABC):
    """A goal with what has to be known of it. Abstract."""

    @abstractmethod
    def distance(self, course: Course) -> float:
        """Return how near a candidate, or the motion after it, comes; infinite if it never does."""

    @abstractmethod
    def cuts(self, course: Course) -> list[Cut]:
        """End the candidate there, in each of the ways that are worth trying."""

    @abstractmethod
    def earlier(self, path: ExitPath) -> int | None:
        """Return the sample at which a path was there before its end; None if it was not."""
