"""WholeRegion and AroundPaths: what grids cover before paths are known, and around paths that are known."""

from __future__ import annotations

import dataclasses
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.graph.coverage import FEWEST_RELIABLE, WORTHWHILE, Coverage
from vibrokit.analyzers.graph.grids import Grids, Shape, halved
from vibrokit.analyzers.graph.seeds import orbit_visits
from vibrokit.analyzers.graph.targets import ExitTarget
from vibrokit.analyzers.graph.tolerances import TOLERANCES
from vibrokit.analyzers.graph.tracing import SolvedGrid
from vibrokit.errors import StructureError
from vibrokit.results.energy import ActivationEnergy

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


class WholeRegion(Coverage):
    """All that lies below the costliest exit, found on grids that cover the region."""

    def first(self, steps: int, shape: Shape, intervals: int) -> Grids:
        """Grids that cover the region."""
        return self.region(steps, shape, intervals)

    @property
    def scale(self) -> float:
        """That of a straight path."""
        return max(target.scale for target in self.targets)

    def highest(self, solved: SolvedGrid) -> float:
        """The cost of the costliest target that is reached; infinite if none is."""
        return solved.highest(self.targets)

    def level(self, solved: SolvedGrid) -> float:
        """The same."""
        return self.highest(solved)

    def rank(self, solved: SolvedGrid) -> float:
        """By V, which interpolation raises."""
        return self.highest(solved)

    def refined(self, fine: SolvedGrid, coarse: SolvedGrid, shape: Shape) -> SolvedGrid | None:
        """The fine one, or a closer one, if the coarse one had enough nodes to say what to cover."""
        reliable = min(coarse.potential.grids.shape) >= FEWEST_RELIABLE
        return self.closer(fine, WORTHWHILE) if fine.potential.grids.shape == shape and reliable else None

    def steps_suffice(self, coarse: SolvedGrid, rougher: SolvedGrid) -> bool:
        """As known paths show, or those on the grid where none are known.

        Interpolation raises V, by no more than what nodes change once these are enough.
        """
        targets, branches = self._judged(coarse)
        room = max(TOLERANCES.steps, coarse.change(rougher, self.reached(coarse)))
        fewer = rougher.potential.grids.shape < coarse.potential.grids.shape
        low, high = max(TOLERANCES.below, 1 - room), 1 + 2 * room if fewer else np.inf
        if not all(low < ratio < high for ratio in self.known_ratios(coarse, branches)):
            return False
        return coarse.linearization_error(targets) <= room

    def ratios(self, solved: SolvedGrid) -> list[float]:
        """By known paths, and elsewhere by those on the grid."""
        targets, branches = self._judged(solved)
        return self.known_ratios(solved, branches) + solved.ratios(targets)

    def _judged(self, solved: SolvedGrid) -> tuple[list[ExitTarget], list[ActivationEnergy]]:
        """Targets that no path is known to, and known paths, but none that cost far less: these get other grids."""
        known = {branch.target for branch in self.branches}
        costs = {
            target: solved.arrival(target).value for target in self.reached(solved) if known.isdisjoint(target.labels)
        }
        highest = max((*costs.values(), *(branch.value for branch in self.branches)), default=0.0)
        targets = [target for target, cost in costs.items() if cost >= TOLERANCES.far_less * highest]
        return targets, [branch for branch in self.branches if branch.value >= TOLERANCES.far_less * highest]


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
        margin = 0.1 * (high - low)
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
        if self.highest(rough) > TOLERANCES.hopeless * self.scale:
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
        return min(self.ratios(coarse)) >= 1 - TOLERANCES.steps

    def rank(self, solved: SolvedGrid) -> float:
        """By how far V is from the action of the costliest known path, above or below."""
        return abs(self.highest(solved) / self.scale - 1)

    def ratios(self, solved: SolvedGrid) -> list[float]:
        """By the known paths."""
        return self.known_ratios(solved, self.branches)

    def far_above(self, solved: SolvedGrid) -> bool:
        """Return whether V at an exit is so far above the action of its path that the grids are too large for it."""
        return max(self.ratios(solved)) > TOLERANCES.loose

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
        solved = self.solved(grids, TOLERANCES.room * self.highest(known), known)
        for _ in range(3):
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
