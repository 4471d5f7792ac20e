"""HierarchySearch: grids that cover no more than the way to some exit targets, and the steps that suit them."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.graph.grids import Grids
from vibrokit.analyzers.graph.hierarchy import GridHierarchy, Shape, TargetEstimate, halved
from vibrokit.analyzers.graph.potential import Potential
from vibrokit.analyzers.graph.step_model import StepModel
from vibrokit.analyzers.graph.targets import ExitTarget, TraceStart
from vibrokit.analyzers.graph.tracing import SolvedGrid
from vibrokit.analyzers.graph.value_iteration import ValueIteration
from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.errors import StructureError
from vibrokit.progress import stage

_SAMPLES = 60  # along each side of the region, whose images show where the other phases need nodes
_MARGIN = 0.04  # of the width, on each side of them
_ROOM = 1.2  # ceiling of V in units of the costliest exit
_NEAR_CEILING = 0.95  # of the ceiling: a value above it may be that of the ceiling
_RAISE, _RAISES = 3.0, 6  # factor and number of trials for a higher ceiling
_WIDENINGS = 6  # of the first grid, each by 30 % at a side: 5 times the region
_ZOOMS, _WORTHWHILE = 4, 0.8  # closer grids, and the ratio of areas above which another one does not pay
_STEP_TOLERANCE = 0.01  # relative change of a cost by linearization that is accepted
# Along a side where several section intervals have grids: half as many found the islands around an orbit of period 3 of
# a weakly damped Duffing oscillator, and 26 did not.
_FEWEST_APART = 90

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclasses.dataclass(frozen=True, eq=False)
class HierarchySearch:
    """Estimates what exit targets cost, each time on a grid hierarchy that covers no more than it needs.

    Hierarchies of the same targets are refined: one with twice the nodes along each side goes on from the fine grid of
    the one before, unless that had very few.
    """

    problem: ExitProblem
    model: StepModel
    steps_per_period: tuple[int, ...]  # to be tried in turn
    finest: Shape  # the last one, whose hierarchies are not kept
    _solved_before: dict[tuple[Shape, frozenset[ExitTarget]], GridHierarchy] = dataclasses.field(default_factory=dict)

    def estimates(
        self, targets: Sequence[ExitTarget], shape: Shape
    ) -> tuple[dict[ExitTarget, TargetEstimate], Potential]:
        """Return what some targets cost, and the potential on the finest grid that covers them.

        Raises StructureError if no target was reached, or if the attractor is not hyperbolic.
        """
        with stage("graph", subject=self.problem.attractor.name, unit="sweeps"):
            hierarchy = self._hierarchy(targets, shape, self._before(frozenset(targets), shape))
            if shape != self.finest:
                self._solved_before[shape, frozenset(targets)] = hierarchy
            return {target: hierarchy.estimate(target) for target in targets}, hierarchy.fine.potential

    def within(self, potential: Potential, target: ExitTarget, shape: Shape) -> list[Candidate]:
        """Return paths to a target that a known potential covers, from a grid around what lies below the target.

        Raises StructureError if the grid does not reach it.
        """
        with stage("graph", subject=self.problem.attractor.name, unit="sweeps"):
            known = SolvedGrid(self.problem, self.model, potential)
            grids, ceiling = self._around(known, (target,))
            solved = self._solved(grids.with_shape(shape), ceiling, (target,), known)
            return [path.candidate for path in solved.paths(target)]

    def _before(self, targets: frozenset[ExitTarget], shape: Shape) -> GridHierarchy | None:
        """The finest hierarchy on fewer nodes that was solved for the fewest other targets."""
        known = [(len(others), -nodes[0], nodes, others) for nodes, others in self._solved_before if targets <= others]
        earlier = [entry for entry in known if entry[2] != shape]
        if not earlier:
            return None
        *_, nodes, others = min(earlier, key=lambda entry: entry[:2])
        return self._solved_before[nodes, others]

    def _hierarchy(self, targets: Sequence[ExitTarget], shape: Shape, before: GridHierarchy | None) -> GridHierarchy:
        """Shorten the steps until linearization over a step changes no cost by much, then solve on all nodes.

        Each step adds an error of interpolation, which raises V. So steps are not shortened where a rougher grid
        changes a cost by more than linearization does, nor beyond where that takes V farther above the actions of its
        paths. Steps are passed over that take V farther below these, or give no path to one of the exits: shorter ones
        may be right where a contact is much shorter than all of them.
        """
        if before is not None and before.fine.potential.grids.shape == _shared(shape, before.intervals):
            return before
        first, *shorter = (count for count in self.steps_per_period if before is None or count >= before.fine.steps)
        if before is not None and before.refined_by(_shared(shape, before.intervals)):
            whole, rougher, coarse = before.whole, before.coarse, self._closer(before.fine, targets, _WORTHWHILE)
        else:
            ceiling = max(target.scale for target in targets) if before is None else before.whole.highest(targets)
            solved = [self._coarser(first, targets, shape, each, 2 * ceiling) for each in self._intervals(before)]
            whole, coarse = min(solved, key=lambda both: both[1].highest(targets))  # interpolation raises V
            rougher = whole
        for count in shorter:
            if coarse.linearization_error(targets) <= max(_STEP_TOLERANCE, coarse.change(rougher, targets)):
                break
            tried = self._coarser(count, targets, shape, coarse.intervals, 2 * whole.highest(targets))
            excess = tried[1].excess(targets)
            if np.isfinite(excess) and excess <= max(coarse.excess(targets), _STEP_TOLERANCE):
                whole, coarse = tried
                rougher = whole
            elif tried[1].lies_above(targets, _STEP_TOLERANCE):
                break
        grids, ceiling = coarse.potential.grids, _ROOM * coarse.highest(targets)
        fine = self._solved(grids.with_shape(_shared(shape, coarse.intervals)), ceiling, targets, coarse)
        long = functools.partial(self._solved, grids.with_double_step(), ceiling, targets, coarse)
        return GridHierarchy(fine, coarse, whole, long)

    def _intervals(self, before: GridHierarchy | None) -> tuple[int, ...]:
        """Numbers of section intervals to try: grids of their own for those of an attractor's period may cover less."""
        if before is not None:
            return (before.intervals,)
        attractor = self.problem.attractor
        return (1, attractor.period) if attractor.is_fixed and attractor.period > 1 else (1,)

    def _coarser(
        self, steps: int, targets: Sequence[ExitTarget], shape: Shape, intervals: int, ceiling: float
    ) -> tuple[SolvedGrid, SolvedGrid]:
        """Solve on the whole region, then on closer and closer grids around what lies below the costliest exit.

        They have half as many nodes along each side as the finest grid of that shape. The ceiling is a first guess.
        """
        grids = self._covering(steps, halved(_shared(shape, intervals))).unfolded(intervals)
        whole = self._solved(grids, ceiling, targets)
        for _ in range(_WIDENINGS):
            wider = grids.widened(self._before_exit(whole, whole.highest(targets), targets))
            if wider is grids:
                break
            grids = wider
            whole = self._solved(grids, 2 * whole.highest(targets), targets)
        coarse = self._closer(whole, targets, np.inf)
        for _ in range(_ZOOMS - 1):
            closer = self._closer(coarse, targets, _WORTHWHILE)
            if closer is coarse:
                break
            coarse = closer
        return whole, coarse

    def _closer(self, solved: SolvedGrid, targets: Sequence[ExitTarget], most: float) -> SolvedGrid:
        """Solve on as many nodes around what lies below the costliest exit, if that is at most a part of the area."""
        grids, ceiling = self._around(solved, targets)
        too_large = grids.area > most * solved.potential.grids.area
        return solved if too_large else self._solved(grids, ceiling, targets, solved)

    def _around(self, solved: SolvedGrid, targets: Sequence[ExitTarget]) -> tuple[Grids, float]:
        """Grids around what lies below the costliest exit, and a ceiling for V on them."""
        ceiling = _ROOM * solved.highest(targets)
        return solved.potential.grids.zoomed(self._before_exit(solved, ceiling, targets)), ceiling

    def _solved(
        self, grids: Grids, ceiling: float, targets: Sequence[ExitTarget], rougher: SolvedGrid | None = None
    ) -> SolvedGrid:
        """Solve up to a ceiling of V, which is raised until the targets lie well below it.

        Where a rougher grid shows that V is above the ceiling, no steps are computed.
        """
        wanted = None if rougher is None else rougher.potential.reached(grids, _ROOM * ceiling)
        iteration = ValueIteration(self.model, self.problem.attractor, grids, wanted)
        for _ in range(_RAISES):
            solved = SolvedGrid(self.problem, self.model, iteration.up_to(ceiling))
            highest = solved.highest(targets)
            if not highest:
                raise StructureError(
                    f"the exits of {self.problem.attractor.name} are within a node of it, so the graph cannot tell "
                    "what they cost; raise the number of nodes."
                )
            if highest < _NEAR_CEILING * ceiling:
                return solved
            ceiling *= _RAISE
            if wanted is not None:  # a path goes beyond what the rougher grid reaches
                wanted, iteration = None, ValueIteration(self.model, self.problem.attractor, grids)
        raise StructureError(
            f"the graph reaches no exit of {self.problem.attractor.name}: the region or the number of nodes leaves no "
            "room for a path; widen the region or raise the number of nodes."
        )

    def _covering(self, steps: int, shape: Shape) -> Grids:
        """Grids that cover the region of the section, and in the other phases also the image of its basins.

        What is in no basin is left out: such motion may grow without bound.
        """
        scene, region = self.problem.scene, self.problem.structure.basins.region
        step = scene.section_interval / steps
        states = region.cell_centres((_SAMPLES, _SAMPLES))
        basins, after = self.problem.structure.basins, self.model.images(states, 0.0, scene.section_interval)
        settled = (basins.at(states) >= 0) & (basins.at(after) >= 0)
        states = states[settled] if settled.any() else states
        boxes = []
        for phase in range(1 if scene.autonomous else steps):
            low = np.minimum(states.min(axis=0), region.bounds[:, 0])
            high = np.maximum(states.max(axis=0), region.bounds[:, 1])
            margin = _MARGIN * (high - low)
            boxes.append(np.stack([low - margin, high + margin], axis=1))
            images = self.model.images(states, phase * step, step)
            states = images[np.isfinite(images).all(axis=1)]
        return Grids(np.array(boxes), shape, step, steps)

    def _before_exit(self, solved: SolvedGrid, ceiling: float, targets: Sequence[ExitTarget]) -> list[Mask]:
        """By phase: which nodes may lie on a path to one of the targets, with V below a ceiling.

        The targets' own places are among them: near a saddle, the basin may be thinner than a cell.
        """
        grids, values = solved.potential.grids, solved.potential.values
        below = [values[phase] < ceiling for phase in range(grids.phases)]
        if any(target.farther for target in targets):
            return below
        for phase, mask in enumerate(below):
            mask[mask] = self._inside(grids.nodes(phase)[mask], grids, phase)
        for target in targets:
            place = solved.arrival(target).place
            if place is not None:
                self._include(below, grids, place)
        return below

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
        return self.problem.structure.basins.at(states) == self.problem.source


def _shared(shape: Shape, intervals: int) -> Shape:
    """Nodes along each side where the grids of several intervals take together what one takes, unless those are few."""
    nx, nv = (max(min(nodes, _FEWEST_APART), round(nodes / intervals**0.5)) for nodes in shape)
    return nx, nv
