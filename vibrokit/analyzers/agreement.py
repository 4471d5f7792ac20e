"""Agreement: polished paths and the graph's estimates, combined into energies with bounds.

`Evidence` also says for which exits a finer graph is of use.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from enum import Enum
from functools import cached_property

import numpy as np

from vibrokit.analyzers.graph.solution import GraphSolution
from vibrokit.analyzers.graph.tolerances import TOLERANCES
from vibrokit.analyzers.path_ends import InBasin
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.results.attractor import Attractor
from vibrokit.results.codes import Code
from vibrokit.results.energy import ActivationEnergy, Bound
from vibrokit.results.finding import Finding
from vibrokit.structure.boundaries.meetings import meeting_cells


class ExitState(Enum):
    """How the energy of one exit is known. The value is the code of the finding that reports it."""

    ATTAINED = Code.DETAILED_BALANCE
    """A path attains the proven minimum."""
    BARRIER = Code.BARRIER_ENERGY
    """The proven minimum is attained, and no polished path shows it."""
    BRACKETED = Code.BRACKET
    """Between the graph and a path from or to an orbit inside a set."""
    AGREED = Code.AGREEMENT
    CHEAPER_EXPECTED = Code.CHEAPER_PATH_EXPECTED
    TOO_COARSE = Code.GRAPH_TOO_COARSE
    NOT_SEARCHED = Code.NOT_SEARCHED
    """A path, and no graph."""
    SHOT_ONLY = Code.NOT_POLISHED
    GRAPH_ONLY = Code.NO_POLISHED_PATH


@dataclasses.dataclass(frozen=True, eq=False)
class ComparedExit:
    """The energy of one exit, how it is known, and the numbers that were compared."""

    energy: ActivationEnergy
    state: ExitState
    values: Mapping[str, float]

    @property
    def finding(self) -> Finding:
        """For reports."""
        return Finding(self.state.value, self.energy.source, self.energy.target, self.values)


@dataclasses.dataclass(frozen=True, eq=False)
class Evidence:
    """Paths, graph and proven minima of the exits of an attractor, and which exits a finer graph can improve.

    Exits are named by the labels of the attractors they lead to.
    """

    attractor: Attractor
    branches: tuple[ActivationEnergy, ...]  # polished, the cheapest first
    graph: GraphSolution | None = None
    least_possible: tuple[ActivationEnergy, ...] = ()
    """The proven minima, where they are known."""
    beyond: frozenset[int] = frozenset()
    """Labels of the attractors that only paths through other basins reach."""

    @cached_property
    def cheapest(self) -> dict[int, ActivationEnergy]:
        """By label: the cheapest polished path."""
        return {branch.target: branch for branch in reversed(self.branches)}

    @cached_property
    def estimates(self) -> tuple[ActivationEnergy, ...]:
        """The estimates of the graph. Paths from or to orbits inside a set do not calibrate it; they give bounds."""
        if self.graph is None or not self.attractor.repeats:
            return () if self.graph is None else self.graph.estimates
        return self.graph.calibrated([branch for branch in self.branches if branch.bound is not Bound.BRACKET])

    def compared(self, shots: Sequence[ActivationEnergy] = ()) -> tuple[ComparedExit, ...]:
        """Return the energy of each exit; `shots` are the action plot's energies."""
        return compared(self.attractor, self.branches, self.estimates, self.least_possible, shots)

    @cached_property
    def attained(self) -> set[int]:
        """Exits with a path that attains the proven minimum."""
        return {target for target, state in self._states.items() if state is ExitState.ATTAINED}

    @cached_property
    def exact(self) -> set[int]:
        """Exits that attain the proven minimum."""
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
            allowed = 1.0 if each.target in self.beyond else TOLERANCES.vague if last else accuracy
            accurate = each.numerical_error <= allowed * each.value or (last and state is ExitState.GRAPH_ONLY)
            if accurate and state in (ExitState.AGREED, ExitState.BRACKETED, ExitState.GRAPH_ONLY):
                found.add(each.target)
        return found

    @cached_property
    def unresolvable(self) -> set[int]:
        """Exits with a path that costs less than the error that even the finest graph would have.

        The error falls by 8 at most when the nodes along a side are doubled, since interpolation is of third order.
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
            if not will_differ and each.numerical_error / 8**graph.finer > path.value:
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


def compared(
    attractor: Attractor,
    branches: Sequence[ActivationEnergy],
    estimates: Iterable[ActivationEnergy],
    least: Iterable[ActivationEnergy] = (),
    shots: Iterable[ActivationEnergy] = (),
) -> tuple[ComparedExit, ...]:
    """Combine the polished paths of an attractor with the graph's estimates, target by target.

    The upper bound is the action of the best path and its numerical error. The lower bound rests on the graph, which
    searches everywhere: it is the smaller of path and graph, each less its error. Where the two differ by more than the
    graph's error, that error was estimated too small, and their difference takes its place. Without a graph nothing
    excludes a cheaper path, and the lower bound is 0.
    Where a minimum is proven, the lower bound is at least that minimum; where the exit attains it, no path is needed. A
    path attains the proven minimum only if both agree within their numerical errors. An action plot's path that was not
    polished is an upper bound within its own error.

    Given are the polished paths, the cheapest first, the graph's estimates, the least possible actions, and the action
    plot's energies.
    """
    path: dict[int, ActivationEnergy] = {}
    for branch in branches:
        path.setdefault(branch.target, branch)
    graph, lowest, shot = ({each.target: each for each in some} for some in (estimates, least, shots))
    known = [target for target, each in lowest.items() if each.bound is Bound.EXACT]
    return tuple(
        _of_target(attractor, _Known(*(some.get(target) for some in (path, graph, lowest, shot))))
        for target in sorted({*path, *graph, *known, *shot}, key=lambda target: (target < 0, target))
    )


@dataclasses.dataclass(frozen=True, eq=False)
class _Known:
    """What was found of the exit to one target."""

    path: ActivationEnergy | None  # polished
    graph: ActivationEnergy | None
    least: ActivationEnergy | None
    shot: ActivationEnergy | None  # by the action plot

    @property
    def values(self) -> dict[str, float]:
        """For the finding."""
        values = {} if self.graph is None else {"graph": self.graph.value, "error": self.graph.numerical_error}
        named = {"path": self.path, "shot": self.shot, "least": self.least}
        return values | {name: energy.value for name, energy in named.items() if energy is not None}


def _of_target(attractor: Attractor, known: _Known) -> ComparedExit:
    path, least = known.path, known.least
    if path is None or (least is not None and least.bound is Bound.EXACT and not _attains(path, least)):
        state, energy = _without_path(known)
    else:
        state, energy = _with_path(attractor, path, known)
    return ComparedExit(energy if least is None else _raised(energy, least), state, known.values)


def _without_path(known: _Known) -> tuple[ExitState, ActivationEnergy]:
    graph, least, shot = known.graph, known.least, known.shot
    if least is not None and least.bound is Bound.EXACT:
        return ExitState.BARRIER, least
    if shot is not None:
        return ExitState.SHOT_ONLY, shot if graph is None else _bracket(shot, graph, Bound.UPPER)
    assert graph is not None
    return ExitState.GRAPH_ONLY, graph


def _with_path(attractor: Attractor, path: ActivationEnergy, known: _Known) -> tuple[ExitState, ActivationEnergy]:
    graph, least = known.graph, known.least
    if least is not None and _attains(path, least):
        without = Bound.EXACT if least.bound is Bound.EXACT else path.bound
        bound = without if path.certificate is None else Bound.CERTIFIED
        return ExitState.ATTAINED, dataclasses.replace(path, bound=bound)
    if graph is None:
        return ExitState.NOT_SEARCHED, path
    if not attractor.repeats or path.bound is Bound.BRACKET:
        return ExitState.BRACKETED, _bracket(path, graph, Bound.BRACKET)
    return _compared(path, graph)


def _attains(path: ActivationEnergy, least: ActivationEnergy) -> bool:
    """Whether a path attains the proven minimum, within the numerical errors of both."""
    return abs(path.value - least.value) <= path.numerical_error + least.numerical_error


def _raised(energy: ActivationEnergy, least: ActivationEnergy) -> ActivationEnergy:
    """Raise an energy to the proven minimum.

    The error of a raised value is at least the difference. An upper bound below the minimum, and that of a certified
    path that attains it, becomes the minimum plus this error.
    """
    raised = least.value - energy.value
    if energy.value >= least.lower:
        return dataclasses.replace(energy, lower=min(max(energy.lower, least.lower), energy.value))
    error = float(np.fmax(raised, energy.numerical_error))
    known = energy.upper >= least.value and (energy.certificate is None or not _attains(energy, least))
    return dataclasses.replace(
        energy,
        value=least.value,
        lower=max(energy.lower, least.lower),
        upper=energy.upper if known else least.value + error,
        numerical_error=error,
    )


def _compared(path: ActivationEnergy, graph: ActivationEnergy) -> tuple[ExitState, ActivationEnergy]:
    """The path's energy with the lower bound that the graph supports, and how the two compare."""
    difference = abs(graph.value - path.value)
    if difference > graph.numerical_error:
        state = ExitState.CHEAPER_EXPECTED if graph.value < path.value else ExitState.TOO_COARSE
        lower = min(path.value, graph.value) - difference
    else:
        state = ExitState.TOO_COARSE if graph.numerical_error > TOLERANCES.vague * path.value else ExitState.AGREED
        lower = min(path.value - path.numerical_error, graph.value - graph.numerical_error)
    bound = Bound.CERTIFIED if state is ExitState.AGREED and path.certificate is not None else Bound.UPPER
    return state, dataclasses.replace(path, lower=max(0.0, lower), bound=bound)


def _bracket(path: ActivationEnergy, graph: ActivationEnergy, bound: Bound) -> ActivationEnergy:
    """Between the graph and a path that need not be the best: of a few orbits inside a set, or not polished.

    The value is the smaller one of both, and that of the path where the graph's error is as large. A graph above the
    path by more than its error has at least the difference as error.
    """
    vague = graph.numerical_error > TOLERANCES.vague * path.value
    best = path if vague or path.value <= graph.value else graph
    above = graph.value - path.value
    least = graph.lower if above <= graph.numerical_error else path.value - above
    lower = min(2 * path.value - path.upper, least)
    return dataclasses.replace(
        path, value=best.value, numerical_error=best.numerical_error, lower=max(0.0, lower), bound=bound
    )
