"""GridHierarchy: one potential on finer and coarser grids, whose differences give the error; and the search for it."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property

import numpy as np

from vibrokit.analyzers.graph.coverage import Coverage
from vibrokit.analyzers.graph.grids import Shape, halved
from vibrokit.analyzers.graph.known_paths import KnownPaths
from vibrokit.analyzers.graph.path_ends import at_saddle
from vibrokit.analyzers.graph.potential import Potential
from vibrokit.analyzers.graph.regions import AroundPaths, WholeRegion
from vibrokit.analyzers.graph.step_model import StepModel
from vibrokit.analyzers.graph.targets import ExitTarget
from vibrokit.analyzers.graph.tolerances import TOLERANCES
from vibrokit.analyzers.graph.traced_path import TracedPath, distinct
from vibrokit.analyzers.graph.tracing import SolvedGrid
from vibrokit.analyzers.path_ends import AtSaddle
from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.errors import StructureError
from vibrokit.progress import stage
from vibrokit.results.energy import ActivationEnergy

_FAR_SMALLER = 0.5  # of the area: grids around known paths, which grow, that are worth beginning anew


@dataclasses.dataclass(frozen=True, eq=False)
class TargetEstimate:
    """What reaching an exit target costs."""

    value: float
    error: float  # both are infinite if the target was not reached
    by_nodes: float  # part of the error that the nodes alone show
    unsettled: float  # the part of the value by which more sweeps may change it
    steps: int  # in a section interval
    known: float  # least action of the paths there that were known before; infinite for none
    paths: tuple[TracedPath, ...]  # distinct ones, the cheapest first

    @property
    def candidates(self) -> tuple[Candidate, ...]:
        """The paths as guesses for polishing; their last states lie beyond the exit."""
        return tuple(path.candidate for path in self.paths)


@dataclasses.dataclass(frozen=True, eq=False)
class GridHierarchy:
    """The potential on the nodes that were asked for, and on half as many along each side."""

    coverage: Coverage
    fine: SolvedGrid
    coarse: SolvedGrid  # half as many nodes on what can be reached for little more than the costliest exit
    whole: SolvedGrid  # as few on all that the region covers, or fewer
    lengthened: Callable[[], SolvedGrid]  # solves the coarse grid with steps twice as long

    @property
    def intervals(self) -> int:
        """Section intervals that have grids of their own."""
        return self.fine.intervals

    @cached_property
    def long(self) -> SolvedGrid:
        """The coarse grid with steps twice as long."""
        return self.lengthened()

    def estimate(self, target: ExitTarget) -> TargetEstimate:
        """Return what an exit target costs.

        The error is the change by halving the nodes, the difference from a path's action by Hamilton's equations (if
        no path was traced, half the change by doubling the step), that of the target's own place, and what more sweeps
        may change.
        """
        by_nodes, unsettled = np.inf, self.fine.potential.unsettled
        fine, coarse = self._value(self.fine, target), self._value(self.coarse, target)
        grids = (self.fine, self.coarse) if np.isfinite(fine) else (self.whole,)
        reached = (grid for grid in grids if np.isfinite(self._value(grid, target)))
        paths = distinct(path for grid in reached for path in grid.paths(target))
        by_step = np.inf
        if np.isfinite([fine, coarse]).all():
            by_step = (
                TOLERANCES.by_path * abs(paths[0].candidate.action - fine)
                if paths
                else 0.5 * abs(coarse - self._value(self.long, target))
            )
        if np.isfinite(by_step):
            by_nodes = abs(fine - coarse) + self.fine.arrival(target).error + unsettled * fine
            value, error = fine, by_nodes + by_step
        else:
            value = error = self._value(self.whole, target)
        known = min((path.value for path in self.coverage.branches if path.target in target.labels), default=np.inf)
        return TargetEstimate(value, error, by_nodes, unsettled, self.fine.steps, known, tuple(paths))

    def _value(self, grid: SolvedGrid, target: ExitTarget) -> float:
        """V at a target; infinite where it is not reached."""
        return grid.arrival(target).value if target in self.coverage.reached(grid) else np.inf


@dataclasses.dataclass(frozen=True, eq=False)
class HierarchySearch:
    """Estimates what exit targets cost, each time on a grid hierarchy that covers no more than it needs.

    Hierarchies of the same targets are refined: one with twice the nodes along each side goes on from the fine grid of
    the one before, unless that had very few. Where V on that grid is far above the actions of known paths, the next
    one begins around these instead.
    """

    problem: ExitProblem
    model: StepModel
    steps_per_period: Mapping[Shape, tuple[int, ...]]  # to be tried in turn, by number of nodes; the finest is the last
    _solved_before: dict[tuple[Shape, frozenset[ExitTarget]], GridHierarchy] = dataclasses.field(default_factory=dict)
    # Of the first grids around known paths, by their targets and actions.
    _areas: dict[frozenset[tuple[int, float]], float] = dataclasses.field(default_factory=dict)
    _embedded: dict[int, ExitTarget] = dataclasses.field(default_factory=dict)  # by number of the saddle

    def estimates(
        self, targets: Sequence[ExitTarget], shape: Shape, known: KnownPaths | None = None
    ) -> tuple[dict[ExitTarget, TargetEstimate], Potential]:
        """Return what some targets cost, and the potential on the finest grid that covers them.

        Raises StructureError if no target was reached, or if the attractor is not hyperbolic.
        """
        with stage("graph", subject=self.problem.attractor.name, unit="sweeps"):
            coverage, before = self._coverage(targets, shape, known or KnownPaths())
            hierarchy = self._hierarchy(coverage, shape, before)
            if shape != list(self.steps_per_period)[-1]:
                self._solved_before[shape, frozenset(targets)] = hierarchy
            return {target: hierarchy.estimate(target) for target in targets}, hierarchy.fine.potential

    def embedded_targets(self, known: KnownPaths) -> list[ExitTarget]:
        """Return targets at the saddles inside chaotic sets that known paths to unsettled exits end at."""
        if not self.problem.attractor.is_fixed:
            return []
        wanted = {path.saddle for path in known.unsettled_paths}
        for end in self.problem.path_ends:
            if isinstance(end, AtSaddle) and end.embedded and end.number in wanted - self._embedded.keys():
                self._embedded[end.number] = at_saddle(end, self.problem, self.model)
        return [self._embedded[number] for number in sorted(wanted & self._embedded.keys())]

    def groups(self, targets: Sequence[ExitTarget], known: KnownPaths) -> list[tuple[list[ExitTarget], KnownPaths]]:
        """Divide targets into groups that get grids of their own, those with the cheapest known paths first.

        A group ends where grids around one more path would be far larger. Exits that the grids for all resolve stay in
        the last group, with the costliest exits and those without a known path. Each group has the paths that its grids
        are for.
        """
        groups, rest = list[tuple[list[ExitTarget], KnownPaths]](), list(targets)
        priced = sorted((target for target in rest if np.isfinite(known.cost(target))), key=known.cost)
        while self._solved_before and priced and self.problem.attractor.is_fixed:
            group, others = [priced[0]], priced[1:]
            while others and not self._far_smaller(group, [*group, others[0]], known):
                group.append(others.pop(0))
            if not others:
                break
            if self._unresolved(group, rest, known):
                groups.append((group, known))
                known = known.with_settled({path.target for path in known.to(group)})
                rest = [target for target in rest if target not in group and known.needs(target)]
            priced = [target for target in others if target in rest]
        return [*groups, (rest, known)] if rest else groups

    def _unresolved(self, group: Sequence[ExitTarget], rest: Sequence[ExitTarget], known: KnownPaths) -> bool:
        """Whether V on the grids before, for a group and all others together, is far above the paths to the group."""
        before = self._before(frozenset(rest), None)
        return before is None or self._around(group, known).far_above(before.fine)

    def _far_smaller(self, few: Sequence[ExitTarget], more: Sequence[ExitTarget], known: KnownPaths) -> bool:
        """Whether grids around the paths to a few targets are far smaller than around those to more."""
        return self._area(known.to(few)) < _FAR_SMALLER * self._area(known.to(more))

    def _area(self, paths: Sequence[ActivationEnergy]) -> float:
        """The area of the first grids around some paths."""
        shape, steps = next(iter(self.steps_per_period.items()))
        key = frozenset((path.target, path.value) for path in paths)
        if key not in self._areas:
            around = AroundPaths(self.problem, self.model, (), paths)
            self._areas[key] = around.first(steps[0], shape, max(self._intervals())).area
        return self._areas[key]

    def _around(self, targets: Sequence[ExitTarget], known: KnownPaths) -> AroundPaths:
        return AroundPaths(self.problem, self.model, targets, known.to(targets))

    def _coverage(
        self, targets: Sequence[ExitTarget], shape: Shape, known: KnownPaths
    ) -> tuple[Coverage, GridHierarchy | None]:
        """Choose what grids have to cover, and the hierarchy on fewer nodes to go on from; None to begin anew.

        Grids begin anew around known paths if they are far smaller there and V on those before was too high.
        """
        before = self._before(frozenset(targets), shape)
        whole, around = WholeRegion(self.problem, self.model, targets, known.to(targets)), self._around(targets, known)
        from_whole = before if before is not None and isinstance(before.coverage, WholeRegion) else None
        if before is None or not (around.branches and known.leads_to_all(targets) and self.problem.attractor.is_fixed):
            return whole, from_whole
        if from_whole is None and frozenset(before.coverage.targets) == frozenset(targets):
            return around, before
        if around.far_above(before.fine):
            grids = before.fine.potential.grids
            closer = around.first(grids.steps, grids.shape, before.intervals)
            if closer.area < _FAR_SMALLER * grids.area:
                return around, None
        return (around, before) if from_whole is None else (whole, before)

    def _before(self, targets: frozenset[ExitTarget], shape: Shape | None) -> GridHierarchy | None:
        """The hierarchy, of another shape than that given, that was solved for some targets and the fewest others.

        Of several, that with the most nodes. Saddles inside chaotic sets need only be reached on its grids.
        """
        embedded = targets & set(self._embedded.values())
        earlier = [
            (len(others - targets), -nodes[0], hierarchy)
            for (nodes, others), hierarchy in self._solved_before.items()
            if nodes != shape and targets - embedded <= others
            and all(np.isfinite(hierarchy.fine.arrival(target).value) for target in embedded - others)
        ]  # fmt: skip
        return min(earlier, key=lambda entry: entry[:2])[-1] if earlier else None

    def _hierarchy(self, coverage: Coverage, shape: Shape, before: GridHierarchy | None) -> GridHierarchy:
        """Shorten the steps until linearization over a step changes no cost by much, then solve on all nodes.

        Each step adds an error of interpolation, which raises V. So steps are not shortened where a rougher grid
        changes a cost by more than linearization does, nor beyond where that takes V farther above the actions of
        paths. Steps are passed over that take V farther below these, or give no path to one of the exits: shorter ones
        may be right where a contact is much shorter than all of them.
        """
        if before is not None and before.fine.potential.grids.shape == _shared(shape, before.intervals):
            return dataclasses.replace(before, coverage=coverage)
        first, *shorter = self._steps(shape, before)
        whole, rougher, coarse = self._begun(coverage, first, shape, before)
        for count in shorter:
            if coverage.steps_suffice(coarse, rougher):
                break
            tried = self._coarser(coverage, count, shape, coarse.intervals, 2 * coverage.highest(whole))
            excess = coverage.excess(tried[1])
            if np.isfinite(excess) and excess <= max(coverage.excess(coarse), TOLERANCES.steps):
                whole, coarse = tried
                rougher = whole
            elif coverage.lies_above(tried[1]):
                break
        grids, ceiling = coarse.potential.grids, TOLERANCES.room * coverage.highest(coarse)
        fine = coverage.solved(grids.with_shape(_shared(shape, coarse.intervals)), ceiling, coarse)
        long = functools.partial(coverage.solved, grids.with_double_step(), ceiling, coarse)
        return GridHierarchy(coverage, fine, coarse, whole, long)

    def _steps(self, shape: Shape, before: GridHierarchy | None) -> list[int]:
        """Numbers of steps to try, at least as many as before; raises StructureError if memory allows none of them."""
        steps = [count for count in self.steps_per_period[shape] if before is None or count >= before.fine.steps]
        if not steps:
            raise StructureError(f"there is not enough memory for {shape} nodes; raise max_memory_gib.")
        return steps

    def _begun(
        self, coverage: Coverage, steps: int, shape: Shape, before: GridHierarchy | None
    ) -> tuple[SolvedGrid, SolvedGrid, SolvedGrid]:
        """The whole grid, a rougher one and the coarse one with the first number of steps."""
        if before is not None:
            coarse = coverage.refined(before.fine, before.coarse, halved(_shared(shape, before.intervals)))
            if coarse is not None:
                return before.whole, before.coarse, coarse
        ceiling = coverage.scale if before is None else coverage.highest(before.whole)
        intervals = self._intervals() if before is None else (before.intervals,)
        solved, failures = list[tuple[SolvedGrid, SolvedGrid]](), list[StructureError]()
        for each in intervals:
            try:
                solved.append(self._coarser(coverage, steps, shape, each, 2 * ceiling))
            except StructureError as failure:
                failures.append(failure)
        if not solved:
            raise failures[0]
        whole, coarse = min(solved, key=lambda both: coverage.rank(both[1]))
        return whole, whole, coarse

    def _intervals(self) -> tuple[int, ...]:
        """Numbers of section intervals to try: grids of their own for those of an attractor's period may cover less."""
        attractor = self.problem.attractor
        return (1, attractor.period) if attractor.is_fixed and attractor.period > 1 else (1,)

    def _coarser(
        self, coverage: Coverage, steps: int, shape: Shape, intervals: int, ceiling: float
    ) -> tuple[SolvedGrid, SolvedGrid]:
        """Half as many nodes along each side as the finest grid of that shape."""
        return coverage.coarser(steps, halved(_shared(shape, intervals)), intervals, ceiling)


def _shared(shape: Shape, intervals: int) -> Shape:
    """Nodes along each side where the grids of several intervals take together what one takes, unless those are few."""
    # Half of 90 found the islands around an orbit of period 3 of a weakly damped Duffing oscillator, and 26 did not.
    nx, nv = (max(min(nodes, 90), round(nodes / intervals**0.5)) for nodes in shape)
    return nx, nv
