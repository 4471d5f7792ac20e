"""Potential: the quasi-potential on grids."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from vibrokit.analyzers.graph.grids import Grids
from vibrokit.kernels.sweeps import interpolate_all

_BLUR = 2  # nodes within which a grid does not resolve V

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclasses.dataclass(frozen=True, eq=False)
class Potential:
    """Least action V from an attractor to every node of every phase."""

    grids: Grids
    values: list[Array]  # (nx, nv) for each phase; `ceiling` where no cheaper path is known
    predecessors: list[Array]  # (nx, nv, 2) for each phase: where the best step to a node of the next starts, as index
    seeded: NDArray[np.bool_]  # (nx, nv): nodes of phase 0 whose V is known beforehand
    orbit: Array  # (count, 2): states of the attractor from phase to phase if it is an orbit; else empty
    ceiling: float  # V up to which paths are searched
    unsettled: float = 0.0  # the part of V by which more sweeps may change it

    def reached(self, grids: Grids, level: float) -> list[Mask]:
        """Return which nodes of each phase of other grids lie near nodes where V is below a level and the ceiling.

        Nodes outside of its own grids count as reached; where these have other phases, all do.
        """
        every, rest = divmod(self.grids.phases, grids.phases)
        if rest or len(self.grids.sections) != len(grids.sections):
            return [np.ones(grids.shape, dtype=bool)] * grids.phases
        most, last, found = min(level, self.ceiling), np.array(self.grids.shape) - 1, []
        for phase in range(grids.phases):
            # What lies more than 2 nodes from where V is low has no part in interpolation there.
            below = ndimage.maximum_filter(self.values[every * phase] < most, size=5)
            index = self.grids.nearest(every * phase, grids.nodes(phase))
            inside = np.clip(index, 0, last)
            found.append(below[inside[..., 0], inside[..., 1]] | np.any(index != inside, axis=-1))
        return found

    def at(self, phase: int, states: Array) -> Array:
        """Return V at states (count, ≥ 2); NaN outside the grid."""
        index = np.where(self.grids.inside(phase, states)[:, None], self.grids.index(phase, states), np.nan)
        return interpolate_all(self.values[phase], np.ascontiguousarray(index))

    def on_section(self, later: int = 0) -> tuple[Array, Array]:
        """Return nodes (nx, nv, 2) at the section, or some phases later, and V there: the least of all intervals."""
        grids, phases = self.grids, range(later, self.grids.phases, self.grids.steps)
        if len(phases) == 1:
            return grids.nodes(later), self.values[later]
        boxes = grids.boxes[list(phases)]
        whole = dataclasses.replace(
            grids, boxes=np.stack([boxes[..., 0].min(axis=0), boxes[..., 1].max(axis=0)], -1)[None]
        )
        nodes = whole.nodes(0)
        states = nodes.reshape(-1, 2)
        values = np.fmin.reduce([self.at(phase, states) for phase in phases])
        return nodes, np.where(np.isnan(values), self.ceiling, values).reshape(nodes.shape[:2])

    def rise(self, phase: int, state: Array) -> float:
        """Return how much V rises within the nodes next to a state, which the grid cannot distinguish from it."""
        return float(self._near(phase, state, (_BLUR, _BLUR)).max() - self.at(phase, state[None])[0])

    def fall(self, phase: int, state: Array, distance: Array) -> float:
        """Return how much V falls within some distance in x and in v of a state."""
        wide, high = np.ceil(distance / self.grids.spacing(phase)).astype(int)
        return float(self.at(phase, state[None])[0] - self._near(phase, state, (int(wide), int(high))).min())

    def _near(self, phase: int, state: Array, reach: tuple[int, int]) -> Array:
        i, j = self.grids.nearest(phase, state)
        return self.values[phase][max(i - reach[0], 0) : i + reach[0] + 1, max(j - reach[1], 0) : j + reach[1] + 1]
