"""What the equations of a path leave undetermined: the time without forcing, and nearly a family of paths."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import scipy.sparse.linalg
from numpy.typing import NDArray

from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.errors import StructureError

_NULL = 1e-2  # singular value of the matching below which paths are nearly a family; generic ones are above it

Array = NDArray[np.float64]


class TimeGauge:
    """The node where the time is fixed and H may jump; both are determined best where the path is fastest."""

    def __init__(self, propagator: SegmentPropagator, points: Array, scale: Array) -> None:
        if len(points) < 3:
            raise StructureError("the guessed path is shorter than three pieces.")
        self.node = 1 + int(np.argmax(np.linalg.norm((points[2:] - points[:-2]) / scale, axis=1)))
        self.point = points[self.node] / scale
        n, rate = len(scale) // 2, propagator.rate(points[self.node], 0.0)
        normal = np.concatenate([-rate[n:], rate[:n]]) * scale  # ∇H = (−p′, q′)
        self.rate, self.normal = (each / np.linalg.norm(each) for each in (rate / scale, normal))


@dataclasses.dataclass(frozen=True, eq=False)
class NearNullDirection:
    """The direction in which the misfits change least, of length 1, if it is nearly undetermined; else 0."""

    direction: Array
    value: float  # the singular value

    @classmethod
    def of(cls, factors: scipy.sparse.linalg.SuperLU, guess: Array) -> NearNullDirection:
        """By inverse iteration: J⁻¹J⁻ᵀ grows the direction of the least singular value by its square."""
        direction, value = guess, math.inf
        if not np.any(guess):
            return cls(guess, math.inf)
        for _ in range(3):
            left = factors.solve(direction / np.linalg.norm(direction), trans="T")
            direction = factors.solve(left / np.linalg.norm(left))
            value = 1 / float(np.linalg.norm(direction))
        return cls(direction * value if value < _NULL else 0.0 * direction, value)

    @property
    def flat(self) -> bool:
        """Whether a shift as long as the path itself makes no misfit, so that rounding decides on its length."""
        return self.value < 1e-7

    @property
    def most(self) -> float:
        """Length of the longest step in this direction, which changes no coordinate by more than 0.03 of its extent."""
        largest = float(np.abs(self.direction).max())
        return 0.03 / largest if largest else math.inf

    def limited(self, step: Array) -> float:
        """Return how far a step goes in this direction, or the longest way."""
        return min(max(float(self.direction @ step), -self.most), self.most)

    def without(self, step: Array) -> Array:
        """Return a step less what it is in this direction."""
        rest: Array = step - (self.direction @ step) * self.direction
        return rest
