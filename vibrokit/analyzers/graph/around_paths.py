"""AroundPaths: coverage for exits that paths are known to, from the attractor outward."""

from __future__ import annotations

import dataclasses
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.graph.coverage import ROOM, STEP_TOLERANCE, Coverage
from vibrokit.analyzers.graph.grids import Grids, Shape, halved
from vibrokit.analyzers.graph.seeds import orbit_visits
from vibrokit.analyzers.graph.tracing import SolvedGrid
from vibrokit.errors import StructureError

LOOSE = 1.5  # V on a grid in units of a known path's action, above which that grid is too large for the path
_EXTENSIONS = 3  # of grids that turn out too small on more nodes
# V on a quarter of the nodes along each side, in units of the action: twice as many divided it by 1.7 to 3.5 on scenes
# where the graph was of use.
_HOPELESS = 16.0
_MARGIN = 0.1  # of the width of what is known, added on each side

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclasses.dataclass(frozen=True, eq=False)
class AroundPaths(Coverage):
    """All that lies below the actions of known paths, found on grids around these and around the attractor.

    Along a path that costs less than a known one, V is below that one's action. So grids grow only until no such node
    lies at their edge, and stay as fine as that allows. From outside, on grids too coarse for V, what lies below it
    would seem to fill them.
    """

    beyond: ClassVar[bool] = True

    @property
    def scale(self) -> float:
        """The action of the costliest known path."""
        return max(branch.value for branch in self.branches)

    def first(self, steps: int, shape: Shape, intervals: int) -> Grids:
        """Grids around the known paths and the ellipses where the linear V is below their actions."""
        whole = self.region(steps, shape, intervals)
        low, high = np.full((2, whole.phases, 2), [[[np.inf]], [[-np.inf]]])
        for visit in orbit_visits(self.model, self.problem.attractor, whole):
            reach = np.sqrt(2 * self.scale * np.diag(visit.covariance))
            low[visit.phase] = np.minimum(low[visit.phase], visit.point - reach)
            high[visit.phase] = np.maximum(high[visit.phase], visit.point + reach)
        for phases, states in self._paths(whole):
            np.minimum.at(low, phases, states)
            np.maximum.at(high, phases, states)
        margin = _MARGIN * (high - low)
        low = np.maximum(low - margin, whole.boxes[..., 0])
        high = np.minimum(high + margin, whole.boxes[..., 1])
        return dataclasses.replace(whole, boxes=np.stack([low, high], axis=-1))

    def highest(self, solved: SolvedGrid) -> float:
        """The cost of the costliest attractor that a path is known to."""
        return max(ratio * branch.value for ratio, branch in zip(self.ratios(solved), self.branches, strict=True))

    def level(self, solved: SolvedGrid) -> float:
        """The action of the costliest known path."""
        return self.scale

    def coarser(self, steps: int, shape: Shape, intervals: int, ceiling: float) -> tuple[SolvedGrid, SolvedGrid]:
        """Let the grids grow on half as many nodes along each side, which is enough to find what has to be covered.

        Raises StructureError where V on these is so high that it would be too high on all nodes as well.
        """
        whole, rough = super().coarser(steps, halved(shape), intervals, ceiling)
        if self.highest(rough) > _HOPELESS * self.scale:
            raise StructureError(
                f"on {rough.potential.grids.shape} nodes around the known paths V is {self.highest(rough):.3g}, and "
                f"they cost {self.scale:.3g}; raise the number of nodes."
            )
        return whole, self._on(shape, rough)

    def refined(self, fine: SolvedGrid, coarse: SolvedGrid, shape: Shape) -> SolvedGrid | None:
        """Return grids around what the fine one shows."""
        return self._on(shape, fine)

    def steps_suffice(self, coarse: SolvedGrid, rougher: SolvedGrid) -> bool:
        """If V is not below the actions of known paths, where only linearization or a cheaper path takes it."""
        return min(self.ratios(coarse)) >= 1 - STEP_TOLERANCE

    def rank(self, solved: SolvedGrid) -> float:
        """By how far V is from the action of the costliest known path, above or below."""
        return abs(self.highest(solved) / self.scale - 1)

    def ratios(self, solved: SolvedGrid) -> list[float]:
        """By the known paths."""
        return self.known_ratios(solved, self.branches)

    def far_above(self, solved: SolvedGrid) -> bool:
        """Return whether V at an exit is so far above the action of its path that the grids are too large for it."""
        return max(self.ratios(solved)) > LOOSE

    def lies_above(self, solved: SolvedGrid) -> bool:
        """Than that of a known path."""
        return max(self.ratios(solved)) > 1 + STEP_TOLERANCE

    def closer(self, solved: SolvedGrid, most: float) -> SolvedGrid:
        """Solve again in any case if nodes that have to be covered lie at the edge."""
        return super().closer(solved, most if self._holds_all(solved) else np.inf)

    def needed(self, solved: SolvedGrid, level: float) -> list[Mask]:
        """Return also the nodes along the known paths."""
        masks, grids = super().needed(solved, level), solved.potential.grids
        last = np.array(grids.shape) - 1
        for phases, states in self._paths(grids):
            for phase in np.unique(phases):
                nearest = np.clip(grids.nearest(phase, states[phases == phase]), 0, last)
                masks[phase][tuple(nearest.T)] = True
        return masks

    def _holds_all(self, solved: SolvedGrid) -> bool:
        grids = solved.potential.grids
        return grids.widened(self.needed(solved, self.scale)) is grids

    def _on(self, shape: Shape, known: SolvedGrid) -> SolvedGrid:
        """Solve on grids of some shape around what others show, and extend those that turn out too small."""
        grids = self.around(known).with_shape(shape)
        solved = self.solved(grids, ROOM * self.highest(known), known)
        for _ in range(_EXTENSIONS):
            if self._holds_all(solved):
                break
            solved = super().closer(solved, np.inf)
        return solved

    def _paths(self, grids: Grids) -> list[tuple[NDArray[np.int64], Array]]:
        """For each known path, the phases that it passes, and its states there."""
        points = self.problem.attractor.points[:, :2]
        found = []
        for branch in self.branches:
            path = branch.path
            assert path is not None
            start = int(path.section[0])
            begins = int(np.argmin(np.linalg.norm(points - path.q[start, :2], axis=1))) % len(grids.sections)
            steps = np.arange(int((path.t[-1] - path.t[start]) / grids.step + 1e-6) + 1)
            times = path.t[start] + steps * grids.step
            states = np.column_stack([np.interp(times, path.t, path.q[:, axis]) for axis in (0, 1)])
            found.append(((begins * grids.steps + steps) % grids.phases, states))
        return found
