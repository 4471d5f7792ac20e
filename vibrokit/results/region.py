"""Region: a rectangle of the section."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import StructureError


@dataclasses.dataclass(frozen=True)
class Region:
    """Bounds of displacement and velocity on the section.

    Parameters
    ----------
    x : (float, float)
        Least and largest displacement (m).
    v : (float, float)
        Least and largest velocity (m s⁻¹).
    """

    x: tuple[float, float]
    v: tuple[float, float]

    def __post_init__(self) -> None:
        for name, bounds in (("x", self.x), ("v", self.v)):
            low, high = bounds
            if not (math.isfinite(low) and math.isfinite(high) and low < high):
                raise StructureError(
                    f"region: {name} goes from {low:g} to {high:g}; give finite bounds, the lower first."
                )

    @classmethod
    def of(cls, bounds: Any) -> Region:
        """Make a region of ((x_min, x_max), (v_min, v_max)), or return it if it is one."""
        if isinstance(bounds, cls):
            return bounds
        try:
            (x_low, x_high), (v_low, v_high) = bounds
            return cls((float(x_low), float(x_high)), (float(v_low), float(v_high)))
        except (TypeError, ValueError) as error:
            raise StructureError(f"region is {bounds!r}; give ((x_min, x_max), (v_min, v_max)).") from error

    @classmethod
    def around(cls, points: NDArray[np.float64], margin: float) -> Region:
        """Return the region around some points, widened on each side by `margin` times its width."""
        low, high = points.min(axis=0), points.max(axis=0)
        width = high - low
        low, high = low - margin * width, high + margin * width
        return cls((float(low[0]), float(high[0])), (float(low[1]), float(high[1])))

    @property
    def bounds(self) -> NDArray[np.float64]:
        """Array (2, 2): bounds of x, bounds of v."""
        return np.array([self.x, self.v])

    @property
    def widths(self) -> NDArray[np.float64]:
        """Widths in x and in v."""
        return np.diff(self.bounds)[:, 0]

    def scaled(self, states: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return x and v of states (…, n) in units of the widths, so that their distances depend on no unit."""
        return states[..., :2] / self.widths

    def apart(self, one: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the distances between states (…, n) in x and v, in units of the widths."""
        return np.asarray(np.linalg.norm(self.scaled(one) - self.scaled(other), axis=-1))

    def contains(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return for each of some points or states (count, n) whether its x and v are in the region."""
        bounds, places = self.bounds, points[:, :2]
        return np.asarray(np.all((places >= bounds[:, 0]) & (places <= bounds[:, 1]), axis=1))

    def cells_at(
        self, states: NDArray[np.float64], counts: Sequence[int]
    ) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """Return in which cell of a grid each state (…, n) is, shape (…, 2), and whether it is in the region.

        Of states outside, the cell is (0, 0).
        """
        low, high = self.bounds.T
        places = (states[..., :2] - low) / (high - low) * np.array(counts)
        inside = np.asarray(((places >= 0) & (places < np.array(counts))).all(axis=-1))
        return np.where(inside[..., None], places, 0.0).astype(np.int64), inside

    def cell_centres(self, cells: Sequence[int]) -> NDArray[np.float64]:
        """Return the centres of a grid of cells, shape (nx · nv, 2), v running fastest."""
        axes = centres(self.bounds, cells)
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)


def centres(bounds: NDArray[np.float64], cells: Sequence[int]) -> list[NDArray[np.float64]]:
    """Return x and v at the centres of a grid of cells between bounds, array (2, 2)."""
    return [
        low + (high - low) * (np.arange(count) + 0.5) / count for (low, high), count in zip(bounds, cells, strict=True)
    ]
