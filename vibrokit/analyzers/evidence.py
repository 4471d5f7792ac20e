"""Evidence: the graph's estimates of the exits of one attractor, compared with its polished paths."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from functools import cached_property

from vibrokit.analyzers.agreement import VAGUE, ComparedExit, ExitState, compared
from vibrokit.analyzers.graph.around_paths import LOOSE
from vibrokit.analyzers.graph.coverage import BELOW
from vibrokit.analyzers.graph.solution import GraphSolution
from vibrokit.analyzers.path_ends import InBasin
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.results.attractor import Attractor
from vibrokit.results.energy import ActivationEnergy, Bound
from vibrokit.structure.boundaries.meetings import meeting_cells

_GAIN = 8.0  # by which the error of the graph falls at most when its nodes along a side are doubled: third order


@dataclasses.dataclass(frozen=True, eq=False)
class Evidence:
    """What is known of the exits of an attractor, and for which of them a finer graph is of use.

    Exits are named by the labels of the attractors they lead to.
    """

    attractor: Attractor
    branches: tuple[ActivationEnergy, ...]  # polished, the cheapest first
    graph: GraphSolution | None = None
    rougher: GraphSolution | None = None  # the last graph on half as many nodes along each side
    least_possible: tuple[ActivationEnergy, ...] = ()
    """What no path can cost less than, where that is known."""
    beyond: frozenset[int] = frozenset()
    """Labels of the attractors that only paths through other basins reach."""

    @cached_property
    def cheapest(self) -> dict[int, ActivationEnergy]:
        """By label: the cheapest polished path."""
        return {branch.target: branch for branch in reversed(self.branches)}

    @cached_property
    def estimates(self) -> tuple[ActivationEnergy, ...]:
        """What the graph estimates; paths from or to orbits inside a set do not calibrate it: they give bounds."""
        return self._estimates_of(self.graph)

    def compared(self, shots: Sequence[ActivationEnergy] = ()) -> tuple[ComparedExit, ...]:
        """Return the energy of each exit; `shots` are the action plot's energies."""
        return compared(self.attractor, self.branches, self.estimates, self.least_possible, shots)

    @property
    def exact(self) -> set[int]:
        """Exits that cost what no path can cost less than."""
        return self._in(ExitState.ATTAINED, ExitState.BARRIER)

    def settled(self, accuracy: float) -> set[int]:
        """Return the exits on which an accurate graph and a path agree, or for which finer grids are of no use."""
        if self.graph is None:
            return set()
        if self.graph.last_for_all:
            found = self._accurate(VAGUE) & self._in(ExitState.AGREED, ExitState.BRACKETED)
            found |= self._in(ExitState.GRAPH_ONLY)
        else:
            found = self._accurate(accuracy) & self._in(ExitState.AGREED)
        return found | (self._useless if self.attractor.repeats else self.unresolvable | self.beyond)

    def _accurate(self, accuracy: float) -> set[int]:
        return {each.target for each in self.estimates if each.numerical_error <= accuracy * each.value}

    @cached_property
    def unresolvable(self) -> set[int]:
        """Exits with a path that costs less than the error that even the finest graph would have.

        The error is expected to fall again as it fell with the nodes along a side since the last graph.
        """
        found, finer = set[int](), 0 if self.graph is None else self.graph.finer
        for each in self.estimates:
            path = self.cheapest.get(each.target)
            if path is None or (finer and self._will_differ(each, path)):
                continue
            if each.numerical_error / self._gain(each) ** finer > path.value:
                found.add(each.target)
        return found

    def _will_differ(self, estimate: ActivationEnergy, path: ActivationEnergy) -> bool:
        """Whether the next grids are for a far cheaper path, found since, or have shorter steps: they tell more."""
        assert self.graph is not None
        solved = self.graph.cheapest[estimate.target]
        cheaper = LOOSE * path.value < solved.known and path.value < estimate.value
        shorter = solved.steps < self.graph.most_steps
        return cheaper or (shorter and estimate.value < BELOW * path.value)

    def _gain(self, estimate: ActivationEnergy) -> float:
        """By which the error of an estimate of the graph is expected to fall when the nodes along a side double."""
        target, error = estimate.target, estimate.numerical_error
        if self.graph is None or self.rougher is None or target not in self._errors_before or not error:
            return _GAIN
        doublings = math.log2(self.graph.cheapest[target].side / self.rougher.cheapest[target].side)
        return min(_GAIN, max(1.0, self._errors_before[target] / error) ** (1 / doublings)) if doublings > 0 else _GAIN

    @cached_property
    def _errors_before(self) -> dict[int, float]:
        """By label: errors of the rougher graph."""
        return {each.target: each.numerical_error for each in self._estimates_of(self.rougher)}

    @property
    def graph_error(self) -> float:
        """The largest relative error of the graph's estimates of first exits; infinite where paths disagree."""
        if self._in(ExitState.CHEAPER_EXPECTED, ExitState.TOO_COARSE) - self._useless:
            return math.inf
        estimates = [each for each in self.estimates if each.target not in self._useless]
        return max((each.numerical_error / each.value for each in estimates if each.value), default=0.0)

    @cached_property
    def _useless(self) -> set[int]:
        """Exits for which finer grids are of no use.

        For an attractor that is reached through other basins a rough estimate suffices. Without a path it is not
        refined further once its error is below its value. Energies that attain the proven minimum have their bounds.
        """
        agreed = self._in(ExitState.AGREED)
        rough = {each.target for each in self.estimates if each.numerical_error < each.value} - self.cheapest.keys()
        beyond = self.beyond & (agreed | rough)
        return self.unresolvable | self.exact | beyond

    @cached_property
    def _states(self) -> dict[int, ExitState]:
        """By label: how graph and path compare."""
        return {one.energy.target: one.state for one in self.compared()}

    def _in(self, *states: ExitState) -> set[int]:
        return {target for target, state in self._states.items() if state in states}

    def _estimates_of(self, graph: GraphSolution | None) -> tuple[ActivationEnergy, ...]:
        if graph is None:
            return ()
        if not self.attractor.repeats:
            return graph.estimates
        return graph.calibrated([branch for branch in self.branches if branch.bound is not Bound.BRACKET])


def reached_through_others(problem: ExitProblem) -> frozenset[int]:
    """Return the labels of the attractors that no saddle leads to, and whose basins do not touch the own one.

    Paths to these pass other basins: they are no first exits.
    """
    unled = {label for end in problem.path_ends if isinstance(end, InBasin) for label in end.targets}
    if not unled:
        return frozenset()
    pairs = meeting_cells(problem.structure.basins)
    touching = {label for pair in pairs if problem.source in pair for label in pair}
    return frozenset(unled - touching)
