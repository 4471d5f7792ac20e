"""Coverage: what grids have to cover for some exit targets, and potentials on grids that cover no more."""

from __future__ import annotations

import dataclasses
import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.graph.grids import Grids, Shape, halved
from vibrokit.analyzers.graph.step_model import StepModel
from vibrokit.analyzers.graph.targets import ExitTarget, TraceStart
from vibrokit.analyzers.graph.tolerances import TOLERANCES
from vibrokit.analyzers.graph.tracing import SolvedGrid
from vibrokit.analyzers.graph.value_iteration import ValueIteration
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.errors import StructureError
from vibrokit.results.energy import ActivationEnergy

_NEAR_CEILING = 0.95  # of the ceiling: a value above it may be that of the ceiling
WORTHWHILE = 0.8  # of the area: a closer grid that is larger does not pay
# Along a side of a grid that says what to cover: 45 covered too much around the chaotic attractor of hertz-0.525, where
# linearized steps made V ten times too small.
FEWEST_RELIABLE = 64

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclasses.dataclass(frozen=True, eq=False)
class Coverage(ABC):
    """What grids have to cover for some exit targets. Abstract."""

    beyond: ClassVar[bool] = False
    """Whether closer grids may reach beyond the edge of those before."""

    problem: ExitProblem
    model: StepModel
    targets: Sequence[ExitTarget]
    branches: Sequence[ActivationEnergy]  # the cheapest known path to each label that is not settled

    @abstractmethod
    def first(self, steps: int, shape: Shape, intervals: int) -> Grids:
        """Return the grids that the search begins with."""

    @property
    @abstractmethod
    def scale(self) -> float:
        """A cost from which the search for the ceiling of V starts."""

    @abstractmethod
    def highest(self, solved: SolvedGrid) -> float:
        """Return the cost of the costliest exit that has to be reached; infinite if one that has to is not reached."""

    @abstractmethod
    def level(self, solved: SolvedGrid) -> float:
        """Return the V below which nodes may lie on a path that is searched."""

    @abstractmethod
    def rank(self, solved: SolvedGrid) -> float:
        """Return a number that is smaller for better ones of several grids with as many nodes."""

    @abstractmethod
    def refined(self, fine: SolvedGrid, coarse: SolvedGrid, shape: Shape) -> SolvedGrid | None:
        """Return a grid of some shape that covers what a finer and a coarse one before show; None if they do not."""

    @abstractmethod
    def steps_suffice(self, coarse: SolvedGrid, rougher: SolvedGrid) -> bool:
        """Return whether shorter steps would change costs by less than the error of the nodes."""

    @abstractmethod
    def ratios(self, solved: SolvedGrid) -> list[float]:
        """V at the exits that the grids are for, in units of the actions of paths; infinite where there is no path."""

    def lies_above(self, solved: SolvedGrid) -> bool:
        """Return whether V at an exit is larger than the action of the path to it, as by interpolation."""
        return any(1 + TOLERANCES.steps < ratio < np.inf for ratio in self.ratios(solved))

    def excess(self, solved: SolvedGrid) -> float:
        """Return the largest difference of the logarithms of V at an exit and of the action of the path to it."""
        return max((abs(math.log(ratio)) for ratio in self.ratios(solved)), default=0.0)

    def reached(self, solved: SolvedGrid) -> list[ExitTarget]:
        """Return the targets whose V lies well below the ceiling."""
        highest = _NEAR_CEILING * solved.potential.ceiling
        return [target for target in self.targets if solved.arrival(target).value < highest]

    def known_ratios(self, solved: SolvedGrid, branches: Sequence[ActivationEnergy]) -> list[float]:
        """For each attractor that a path leads to, return the least V where it is reached from, over the action."""
        found = []
        for branch in branches:
            values = [solved.arrival(target).value for target in self.targets if branch.target in target.labels]
            found.append(min(values) / branch.value)
        return found

    def coarser(self, steps: int, shape: Shape, intervals: int, ceiling: float) -> tuple[SolvedGrid, SolvedGrid]:
        """Solve on the first grids, widened if need be, then on closer ones. The ceiling is a first guess."""
        whole = self._wide_enough(self.first(steps, shape, intervals), ceiling)
        coarse = self.closer(whole, np.inf)
        for _ in range(3):
            closer = self.closer(coarse, WORTHWHILE)
            if closer is coarse:
                break
            coarse = closer
        return whole, coarse

    def _wide_enough(self, grids: Grids, ceiling: float) -> SolvedGrid:
        """Solve on grids that are as wide as half as many nodes along each side show to be needed.

        Where these are too few to reach an exit, all of them show it.
        """
        shape = grids.shape
        if min(halved(shape)) < FEWEST_RELIABLE:
            return self._wide(grids, ceiling)
        try:
            rough = self._wide(grids.with_shape(halved(shape)), ceiling)
        except StructureError:
            return self._wide(grids, ceiling)
        return self.solved(rough.potential.grids.with_shape(shape), 2 * self.highest(rough))

    def _wide(self, grids: Grids, ceiling: float) -> SolvedGrid:
        """Solve on grids that are widened until no node that has to be covered lies at their edge."""
        solved = self.solved(grids, ceiling)
        for _ in range(6):  # each by 30 % at a side: to 5 times its size
            wider = grids.widened(self.needed(solved, self.level(solved)))
            if wider is grids:
                break
            grids, solved = wider, self.solved(wider, 2 * self.highest(solved))
        return solved

    def closer(self, solved: SolvedGrid, most: float) -> SolvedGrid:
        """Solve on as many nodes around what has to be covered, if that is at most a part of the area."""
        grids = self.around(solved)
        too_large = grids.area > most * solved.potential.grids.area
        return solved if too_large else self.solved(grids, TOLERANCES.room * self.highest(solved), solved)

    def around(self, solved: SolvedGrid) -> Grids:
        """Return grids around what has to be covered."""
        return solved.potential.grids.zoomed(
            self.needed(solved, TOLERANCES.room * self.level(solved)), beyond=self.beyond
        )

    def solved(self, grids: Grids, ceiling: float, rougher: SolvedGrid | None = None) -> SolvedGrid:
        """Solve up to a ceiling of V, which is raised until the targets lie well below it.

        Where a rougher grid shows that V is above the ceiling, no steps are computed. Raises StructureError if no
        target is reached.
        """
        wanted = None if rougher is None else rougher.potential.reached(grids, TOLERANCES.room * ceiling)
        iteration = ValueIteration(self.model, self.problem.attractor, grids, wanted)
        for _ in range(6):
            solved = SolvedGrid(self.problem, self.model, iteration.up_to(ceiling))
            highest = self.highest(solved)
            if not highest:
                raise StructureError(
                    f"the exits of {self.problem.attractor.name} are within a node of it, so the graph cannot tell "
                    "what they cost; raise the number of nodes."
                )
            if highest < _NEAR_CEILING * ceiling:
                return solved
            ceiling *= 3.0
            if wanted is not None:  # a path goes beyond what the rougher grid reaches
                wanted, iteration = None, ValueIteration(self.model, self.problem.attractor, grids)
        raise StructureError(
            f"the graph reaches no exit of {self.problem.attractor.name}: the region or the number of nodes leaves no "
            "room for a path; widen the region or raise the number of nodes."
        )

    def needed(self, solved: SolvedGrid, level: float) -> list[Mask]:
        """By phase: which nodes may lie on a path to one of the targets, with V below a level.

        The targets' own places are among them: near a saddle, the basin may be thinner than a cell.
        """
        grids, values = solved.potential.grids, solved.potential.values
        below = [values[phase] < level for phase in range(grids.phases)]
        if any(target.farther for target in self.targets):
            return below
        for phase, mask in enumerate(below):
            mask[mask] = self._inside(grids.nodes(phase)[mask], grids, phase)
        for target in self.targets:
            place = solved.arrival(target).place
            if place is not None:
                self._include(below, grids, place)
        return below

    def region(self, steps: int, shape: Shape, intervals: int) -> Grids:
        """Grids that cover the region of the section and the targets, and in the other phases the image of its basins.

        What is in no basin is left out: such motion may grow without bound.
        """
        scene, region = self.problem.scene, self.problem.structure.basins.region
        step = scene.section_interval / steps
        states = region.cell_centres((60, 60))
        basins, after = self.problem.structure.basins, self.model.images(states, 0.0, scene.section_interval)
        settled = (basins.at(states) >= 0) & (basins.at(after) >= 0)
        states = np.concatenate([states[settled] if settled.any() else states, *(one.places for one in self.targets)])
        boxes = []
        for phase in range(1 if scene.autonomous else steps):
            low = np.minimum(states.min(axis=0), region.bounds[:, 0])
            high = np.maximum(states.max(axis=0), region.bounds[:, 1])
            margin = 0.04 * (high - low)
            boxes.append(np.stack([low - margin, high + margin], axis=1))
            images = self.model.images(states, phase * step, step)
            states = images[np.isfinite(images).all(axis=1)]
        return Grids(np.array(boxes), shape, step, steps).unfolded(intervals)

    def _include(self, masks: list[Mask], grids: Grids, place: TraceStart) -> None:
        """Include the nodes next to the motion from a state until the next section."""
        phase, state = place.phase, place.state
        for _ in range(min(grids.steps, grids.phases)):
            if not grids.inside(phase, state):
                break
            masks[phase][tuple(grids.nearest(phase, state))] = True
            state = self.model.images(state[None], grids.time(phase), grids.step)[0]
            phase = (phase + 1) % grids.phases

    def _inside(self, states: Array, grids: Grids, phase: int) -> Mask:
        """Which states of a phase have not left: by their positions, or by the cells of the section they come to."""
        if self.problem.exit.by_position:
            return ~self.problem.is_out(states)
        if phase not in grids.sections:
            rest = (grids.steps - phase % grids.steps) * grids.step
            states = self.model.images(states, grids.time(phase), rest)
        labels = self._labels(states) if self._paths_leave_region else self.problem.structure.basins.at(states)
        return labels == self.problem.source

    @cached_property
    def _paths_leave_region(self) -> bool:
        """Whether known paths show that what lies beyond the region has to be covered."""
        region = self.problem.structure.basins.region
        paths = (branch.path for branch in self.branches)
        return any(not region.contains(path.q[path.section, :2]).all() for path in paths if path is not None)

    def _labels(self, states: Array) -> NDArray[np.int16]:
        """Return the labels of the basins that states on the section are in.

        States outside the region are followed until they come back to it, for 8 section intervals.
        """
        basins, interval = self.problem.structure.basins, self.problem.scene.section_interval
        labels, outside = basins.at(states), np.flatnonzero(~basins.region.contains(states))
        states = states[outside]
        for _ in range(8):
            if not outside.size:
                break
            states = self.model.images(states, 0.0, interval)
            labels[outside] = basins.at(states)
            left = np.isfinite(states).all(axis=1) & ~basins.region.contains(states)
            states, outside = states[left], outside[left]
        return labels
