"""Where extremal paths are started: places in a unit cube that stand for states near an attractor."""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.quasi_potential import LocalPotential

Array = NDArray[np.float64]


class Starts(ABC):
    """A family of starts on the attractor's unstable manifold in (q, p). Abstract."""

    @property
    @abstractmethod
    def dimension(self) -> int:
        """How many numbers between 0 and 1 name a start; the first is the angle in turns."""

    @property
    def polars(self) -> int:
        """How many polar angles follow the angle, in half turns."""
        return 0

    @property
    def patience(self) -> int:
        """How many rounds without change end a search."""
        return 3

    def depth(self, first: Array) -> int:
        """Return how many times a box of the first grid must be split in three before the slowest way out can show."""
        return 0

    @abstractmethod
    def states(self, places: Array) -> tuple[Array, Array]:
        """Return states (q, p, S), shape (count, 2n + 1), and their times (s) since a section, of places (count, d)."""

    @abstractmethod
    def grid(self, points: int) -> tuple[int, ...]:
        """Return how many places to take along each number, about so many in all, for cells about as long as wide."""

    @abstractmethod
    def fractions(self, places: Array) -> Array:
        """Return how far from the inner to the outer edge each place is, from 0 to 1."""


@dataclasses.dataclass(frozen=True, eq=False)
class Ring(Starts):
    """A circle round the attractor's point on the section.

    Attributes
    ----------
    point : array (n,)
    potential : LocalPotential
    radius : float
        In m and m s⁻¹ alike.
    """

    point: Array
    potential: LocalPotential
    radius: float

    @property
    def dimension(self) -> int:
        """The angle."""
        return 1

    def states(self, places: Array) -> tuple[Array, Array]:
        """On the circle, at the section."""
        starts = ring_starts(self.point, self.potential, self.radius, 2 * np.pi * places[:, 0])
        return starts, np.zeros(len(places))

    def grid(self, points: int) -> tuple[int, ...]:
        """All round."""
        return (points,)

    def fractions(self, places: Array) -> Array:
        """All on the one circle."""
        return np.zeros(len(places))


def ring_starts(point: Array, potential: LocalPotential, radius: float, angles: Array) -> Array:
    """Return starts (q, p, S) on a circle: p = Σ⁻¹ δq and S = ½ δqᵀ Σ⁻¹ δq, shape (angles, 2n + 1)."""
    offset = np.zeros((len(angles), len(point)))
    offset[:, 0], offset[:, 1] = radius * np.cos(angles), radius * np.sin(angles)
    momentum = offset @ potential.stiffness
    action = 0.5 * np.einsum("ij,ij->i", offset, momentum)
    return np.column_stack([point + offset, momentum, action])
