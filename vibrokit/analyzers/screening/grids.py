"""Grids of the phases of a period: what each covers, and how places on it are counted."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.results.region import Region
from vibrokit.symbolic.flow_kind import Flow

_SAMPLES = 60  # along each side of the region that is carried through the phases
_MARGIN = 0.04  # of the width, on each side
_ROOM = 0.1
_WIDER, _EDGE = 0.3, 3  # of the width; nodes
_ROOM_IN_CELLS = 3

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclasses.dataclass(frozen=True, eq=False)
class Grids:
    """A grid of nodes (x, v) for each phase; all with as many nodes.

    Attributes
    ----------
    boxes : array (phases, 2, 2)
        Bounds of x and of v; the outermost nodes lie on them.
    cells : (int, int)
        Nodes in x and in v.
    step : float
        Time from phase to phase (s).
    """

    boxes: Array
    cells: tuple[int, int]
    step: float

    @property
    def phases(self) -> int:
        """How many there are: 1 in an autonomous scene."""
        return len(self.boxes)

    def time(self, phase: int) -> float:
        """Time of a phase (s) since the section."""
        return phase * self.step

    def spacing(self, phase: int) -> Array:
        """Distance of nodes in x and in v, shape (2,)."""
        widths: Array = np.diff(self.boxes[phase], axis=1)[:, 0] / (np.array(self.cells) - 1)
        return widths

    @property
    def area(self) -> float:
        """Of all boxes together."""
        return float(np.prod(np.diff(self.boxes, axis=2)[..., 0], axis=1).sum())

    def nodes(self, phase: int) -> Array:
        """States of the nodes, shape (nx, nv, 2)."""
        axes = [np.linspace(low, high, count) for (low, high), count in zip(self.boxes[phase], self.cells, strict=True)]
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)

    def places(self, phase: int, states: Array) -> Array:
        """Return where states (…, ≥ 2) are, in cells."""
        places: Array = (states[..., :2] - self.boxes[phase, :, 0]) / self.spacing(phase)
        return places

    def states(self, phase: int, places: Array) -> Array:
        """Return the states at some places."""
        states: Array = self.boxes[phase, :, 0] + places * self.spacing(phase)
        return states

    def inside(self, phase: int, states: Array) -> Mask:
        """Return which states have a whole cell of nodes all around them."""
        places = self.places(phase, states)
        return np.all((places >= 1) & (places <= np.array(self.cells) - 2), axis=-1)

    def of(self, cells: tuple[int, int]) -> Grids:
        """Return grids that cover the same with another number of nodes."""
        return dataclasses.replace(self, cells=cells)

    def widened(self, wanted: list[Mask]) -> Grids:
        """Return grids that reach farther on each side that some of the nodes lie at; the same grids if none do."""
        boxes = self.boxes.copy()
        for phase, mask in enumerate(wanted):
            more = _WIDER * np.diff(self.boxes[phase], axis=1)[:, 0]
            for axis, edge in enumerate((mask, mask.T)):
                boxes[phase, axis, 0] -= more[axis] * bool(edge[:_EDGE].any())
                boxes[phase, axis, 1] += more[axis] * bool(edge[-_EDGE:].any())
        return self if np.array_equal(boxes, self.boxes) else dataclasses.replace(self, boxes=boxes)

    def zoomed(self, wanted: list[Mask]) -> Grids:
        """Return grids that cover some of the nodes of each phase, with room round them."""
        boxes = self.boxes.copy()
        for phase, mask in enumerate(wanted):
            if mask.any():
                states = self.nodes(phase)[mask]
                low, high = states.min(axis=0), states.max(axis=0)
                room = _ROOM * (high - low) + _ROOM_IN_CELLS * self.spacing(phase)
                boxes[phase, :, 0] = np.maximum(low - room, boxes[phase, :, 0])
                boxes[phase, :, 1] = np.minimum(high + room, boxes[phase, :, 1])
        return dataclasses.replace(self, boxes=boxes)


def covering(osc: Oscillator, stepper: Stepper, region: Region, fraction: int, cells: tuple[int, int]) -> Grids:
    """Return grids that cover a region of the section, in the other phases also what the motion carries it to."""
    step = osc.section_interval / fraction
    states = region.cell_centres((_SAMPLES, _SAMPLES))
    boxes = []
    for phase in range(1 if osc.autonomous else fraction):
        low = np.minimum(states.min(axis=0), region.bounds[:, 0])
        high = np.maximum(states.max(axis=0), region.bounds[:, 1])
        room = _MARGIN * (high - low)
        boxes.append(np.stack([low - room, high + room], axis=1))
        ended = run_ensemble(osc, Flow.STATE, stepper, states, 1, start_time=phase * step, interval=step)
        states = ended.states[np.isfinite(ended.states).all(axis=1)]
    return Grids(np.array(boxes), cells, step)
