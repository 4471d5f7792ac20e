"""Evidence: the graph's estimates of the exits of one attractor, compared with its polished paths."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from functools import cached_property

from vibrokit.analyzers.agreement import VAGUE, ComparedExit, ExitState, compared
from vibrokit.analyzers.graph.solution import GraphSolution
from vibrokit.analyzers.graph.tolerances import TOLERANCES
from vibrokit.analyzers.path_ends import InBasin
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.results.attractor import Attractor
from vibrokit.results.energy import ActivationEnergy, Bound
from vibrokit.structure.boundaries.meetings import meeting_cells


@dataclasses.dataclass(frozen=True, eq=False)
class Evidence:
    """What is known of the exits of an attractor, and for which of them a finer graph is of use.

    Exits are named by the labels of the attractors they lead to.
    """

    attractor: Attractor
    branches: tuple[ActivationEnergy, ...]  # polished, the cheapest first
    graph: GraphSolution | None = None
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
        if self.graph is None or not self.attractor.repeats:
            return () if self.graph is None else self.graph.estimates
        return self.graph.calibrated([branch for branch in self.branches if branch.bound is not Bound.BRACKET])

    def compared(self, shots: Sequence[ActivationEnergy] = ()) -> tuple[ComparedExit, ...]:
        """Return the energy of each exit; `shots` are the action plot's energies."""
        return compared(self.attractor, self.branches, self.estimates, self.least_possible, shots)

    @cached_property
    def exact(self) -> set[int]:
        """Exits that cost what no path can cost less than."""
        return {target for target, state in self._states.items() if state in (ExitState.ATTAINED, ExitState.BARRIER)}

    def settled(self, accuracy: float) -> set[int]:
        """Return the exits for which more nodes are of no use.

        ======================================  =====================================================
        exit                                    settled
        ======================================  =====================================================
        that attains the proven minimum         always: no graph gave its bounds
        that even the finest grid will not      always
        resolve
        where path and graph contradict each    never
        other
        that only paths through other basins    once the graph's error is below its value
        reach
        any other                               once that error is at most `accuracy` of the value
        ======================================  =====================================================

        Twice the nodes that were asked for are only for paths that the graph is too coarse for. Before these, half of
        the value is enough of an accuracy, and an exit without a path is settled.
        """
        found = self.exact | self.unresolvable
        last = self.graph is not None and self.graph.last_for_all
        for each in self.estimates:
            state = self._states[each.target]
            allowed = 1.0 if each.target in self.beyond else VAGUE if last else accuracy
            accurate = each.numerical_error <= allowed * each.value or (last and state is ExitState.GRAPH_ONLY)
            if accurate and state in (ExitState.AGREED, ExitState.BRACKETED, ExitState.GRAPH_ONLY):
                found.add(each.target)
        return found

    @cached_property
    def unresolvable(self) -> set[int]:
        """Exits with a path that costs less than the error that even the finest graph would have.

        Finer grids may tell more than that if they are for a far cheaper path, found since, or have shorter steps where
        V is below the action of the path.
        """
        found, graph = set[int](), self.graph
        for each in self.estimates:
            path = self.cheapest.get(each.target)
            if graph is None or path is None:
                continue
            solved = graph.cheapest[each.target]
            cheaper = TOLERANCES.loose * path.value < solved.known and path.value < each.value
            shorter = solved.steps < graph.most_steps and each.value < TOLERANCES.below * path.value
            will_differ = graph.finer and (cheaper or shorter)
            if not will_differ and each.numerical_error / TOLERANCES.gain**graph.finer > path.value:
                found.add(each.target)
        return found

    @cached_property
    def _states(self) -> dict[int, ExitState]:
        """By label: how graph and path compare."""
        return {one.energy.target: one.state for one in self.compared()}


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
