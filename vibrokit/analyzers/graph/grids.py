"""Grids: the nodes at each phase of one section interval or several, and where states lie among them."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

_FEWEST_NODES = 16  # along a side of the coarse grids
_EDGE = 3  # nodes at a side that make it grow

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Shape = tuple[int, int]
"""Nodes in x and in v."""


@dataclasses.dataclass(frozen=True, eq=False)
class Grids:
    """A grid of nodes (x, v) for each phase, all with the same number of nodes.

    The phases are those of one section interval, or of an attractor's period: its points on the section lie apart, and
    each has a smaller grid of its own then.
    """

    boxes: Array  # (phases, 2, 2): bounds of x and of v; the outermost nodes lie on them
    shape: Shape  # nodes in x and in v
    step: float  # time from phase to phase (s)
    steps: int  # in a section interval

    @property
    def phases(self) -> int:
        """Number of phases: 1 for an autonomous scene."""
        return len(self.boxes)

    @property
    def sections(self) -> range:
        """Phases that are on the section."""
        return range(0, self.phases, self.steps)

    @property
    def area(self) -> float:
        """Area of all boxes together."""
        return float(np.prod(np.diff(self.boxes, axis=2)[..., 0], axis=1).sum())

    def time(self, phase: int) -> float:
        """Time of a phase since the first section (s)."""
        return phase * self.step

    def spacing(self, phase: int) -> Array:
        """Distance between nodes in x and in v, shape (2,)."""
        widths: Array = np.diff(self.boxes[phase], axis=1)[:, 0] / (np.array(self.shape) - 1)
        return widths

    def nodes(self, phase: int) -> Array:
        """States of the nodes, shape (nx, nv, 2)."""
        axes = [np.linspace(low, high, count) for (low, high), count in zip(self.boxes[phase], self.shape, strict=True)]
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)

    def index(self, phase: int, states: Array) -> Array:
        """Return the fractional indices of states (…, ≥ 2), shape (…, 2)."""
        index: Array = (states[..., :2] - self.boxes[phase, :, 0]) / self.spacing(phase)
        return index

    def nearest(self, phase: int, states: Array) -> NDArray[np.int64]:
        """Return the indices of the nearest nodes to states (…, ≥ 2), as if there were nodes everywhere, (…, 2)."""
        return np.rint(self.index(phase, states)).astype(np.int64)

    def states(self, phase: int, index: Array) -> Array:
        """Return the states at fractional indices (…, 2)."""
        states: Array = self.boxes[phase, :, 0] + index * self.spacing(phase)
        return states

    def inside(self, phase: int, states: Array) -> Mask:
        """Return which states are at least one node away from the edge."""
        index = self.index(phase, states)
        return np.all((index >= 1) & (index <= np.array(self.shape) - 2), axis=-1)

    def with_shape(self, shape: Shape) -> Grids:
        """Return grids on the same boxes with another number of nodes."""
        return dataclasses.replace(self, shape=shape)

    def with_double_step(self) -> Grids:
        """Return every second grid, or the only one, with steps twice as long."""
        return dataclasses.replace(self, boxes=self.boxes[::2], step=2 * self.step, steps=self.steps // 2)

    def unfolded(self, intervals: int) -> Grids:
        """Return grids for each of several section intervals, on the same boxes."""
        return dataclasses.replace(self, boxes=np.tile(self.boxes, (intervals, 1, 1)))

    def widened(self, needed: list[Mask]) -> Grids:
        """Return grids that reach farther on each side where needed nodes lie; the same grids if there are none."""
        boxes = self.boxes.copy()
        for phase, mask in enumerate(needed):
            more = 0.3 * np.diff(self.boxes[phase], axis=1)[:, 0]
            for axis, edge in enumerate((mask, mask.T)):
                boxes[phase, axis, 0] -= more[axis] * bool(edge[:_EDGE].any())
                boxes[phase, axis, 1] += more[axis] * bool(edge[-_EDGE:].any())
        return self if np.array_equal(boxes, self.boxes) else dataclasses.replace(self, boxes=boxes)

    def zoomed(self, needed: list[Mask], *, beyond: bool = False) -> Grids:
        """Return grids that cover the needed nodes of each phase, with a margin, which may lie beyond the edge."""
        boxes = self.boxes.copy()
        for phase, mask in enumerate(needed):
            if mask.any():
                states = self.nodes(phase)[mask]
                low, high = states.min(axis=0), states.max(axis=0)
                margin = 0.1 * (high - low) + 3 * self.spacing(phase)
                closer = np.stack([low - margin, high + margin], axis=1)
                boxes[phase] = closer if beyond else np.clip(closer, *boxes[phase].T[..., None])
        return dataclasses.replace(self, boxes=boxes)


def halved(shape: Shape) -> Shape:
    """Return half as many nodes along each side, but not very few."""
    return max(_FEWEST_NODES, shape[0] // 2), max(_FEWEST_NODES, shape[1] // 2)
