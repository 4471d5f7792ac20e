"""Where extremal paths start: points of a unit cube that stand for states near an attractor."""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.paths.local_potential import LocalPotential, local_potential
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.kernels.stepper import Stepper

Array = NDArray[np.float64]


class Starts(ABC):
    """A family of starts on the attractor's unstable manifold in (q, p). Abstract."""

    method: ClassVar[str] = "action plot"
    """As in `ActivationEnergy.method`."""

    @property
    @abstractmethod
    def growth(self) -> float:
        """Factor by which a deviation from the attractor grows on the way to the exit."""

    @property
    def patience(self) -> int:
        """Number of rounds without change that end a search."""
        return 3

    def depth(self, first: Array) -> int:
        """Return how many times a box with sides `first` must be split in three before the slowest exit path shows."""
        return 0

    def fractions(self, places: Array) -> Array:
        """Return how far each place is from the inner to the outer edge, from 0 to 1."""
        return np.zeros(len(places))

    @abstractmethod
    def states(self, places: Array) -> tuple[Array, Array]:
        """Return states (q, p, S), shape (count, 2n + 1), and their times (s) since a section.

        Places (count, d) have coordinates between 0 and 1. The first is the angle in turns; polar angles in half turns
        follow it where the noise has extra states.
        """

    @abstractmethod
    def grid(self, points: int) -> tuple[int, ...]:
        """Return the numbers of places along each coordinate, about `points` in all, that make cells nearly square."""

    @abstractmethod
    def with_stepper(self, problem: ExitProblem, stepper: Stepper) -> Self:
        """Return the same family around the orbit that another stepper gives."""


@dataclasses.dataclass(frozen=True, eq=False)
class Ring(Starts):
    """A circle around the attractor's point on the section."""

    method: ClassVar[str] = "action plot (ring)"

    point: Array  # (n,)
    potential: LocalPotential
    radius: float  # in m and m s⁻¹ alike

    @classmethod
    def around(cls, problem: ExitProblem, stepper: Stepper, radius: float) -> Self:
        """Make a circle around the orbit that a stepper gives."""
        orbit = problem.orbit(stepper)
        return cls(orbit.point, local_potential(problem.scene, orbit, stepper), radius)

    @property
    def growth(self) -> float:
        """As if the exit were at distance 1."""
        return 1 / self.radius

    def states(self, places: Array) -> tuple[Array, Array]:
        """On the circle, at the section: p = Σ⁻¹ δq and S = ½ δqᵀ Σ⁻¹ δq."""
        angles, offset = 2 * np.pi * places[:, 0], np.zeros((len(places), len(self.point)))
        offset[:, 0], offset[:, 1] = self.radius * np.cos(angles), self.radius * np.sin(angles)
        momentum = offset @ self.potential.stiffness
        action = 0.5 * np.einsum("ij,ij->i", offset, momentum)
        return np.column_stack([self.point + offset, momentum, action]), np.zeros(len(places))

    def grid(self, points: int) -> tuple[int, ...]:
        """Equal angles."""
        return (points,)

    def with_stepper(self, problem: ExitProblem, stepper: Stepper) -> Self:
        """The circle of the same radius."""
        return self.around(problem, stepper, self.radius)
