"""PassingSearch: exit paths in legs, through an orbit that a candidate passes before its end."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
from collections import Counter
from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.path_ends import AtSaddle, PathEnd
from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.polishing.ends import Nodes, obstacle
from vibrokit.analyzers.polishing.leg import Departure, LegSolver, SolvedPath
from vibrokit.analyzers.polishing.path_solver import Effort
from vibrokit.analyzers.polishing.tolerances import TOLERANCES
from vibrokit.errors import StructureError

_PASSED = 0.05  # of a candidate's extent: distance from an orbit that it passes; grids place it to 0.003 to 0.04

Array = NDArray[np.float64]


class PassingSearch:
    """Solves for paths that pass one orbit after another.

    The least action may be that of a path through a saddle, and through the attractor that motion from there leads to,
    before the end. It is the sum over its legs, from each of these orbits to the next (Freidlin and Wentzell, "Random
    Perturbations of Dynamical Systems", 6.2). Each leg takes infinite time, so that no single path is found near it.
    """

    def __init__(self, nodes: Nodes) -> None:
        self._nodes, self._problem, structure = nodes, nodes.problem, nodes.problem.structure
        self._tries: Counter[tuple[LegSolver, PathEnd]] = Counter()
        self._from_saddle = functools.cache(
            lambda number: LegSolver(nodes, Departure.from_saddle(number, structure.saddles[number]))
        )
        self._from_attractor = functools.cache(
            lambda label: LegSolver(nodes, Departure.from_attractor(structure.attractors[label]))
        )

    @cached_property
    def ends(self) -> list[PathEnd]:
        """All saddles that such paths may end at, those between other basins too."""
        return [
            end
            for end in self._problem.path_ends
            if isinstance(end, AtSaddle) and not end.one_of_many and not obstacle(end, self._problem)
        ]

    def solve(self, end: PathEnd, candidate: Candidate, known: Sequence[SolvedPath]) -> SolvedPath | None:
        """Return a path to an end of which a known path is the first part, tried three times; None if none is found."""
        with contextlib.suppress(StructureError):  # one of the orbits is not hyperbolic
            for first, solver, rest in self._splits(end, candidate, known):
                self._tries[solver, end] += 1
                if self._tries[solver, end] <= 3:
                    with contextlib.suppress(StructureError):
                        leg = solver.solve(end, rest, Effort.DESCEND)
                        if first.action + leg.found.action <= TOLERANCES.worth * candidate.action:
                            return SolvedPath.of(self._problem, (*first.legs, leg), candidate.finder)
        return None

    def _splits(
        self, end: PathEnd, candidate: Candidate, known: Sequence[SolvedPath]
    ) -> list[tuple[SolvedPath, LegSolver, Candidate]]:
        """Known paths to saddles that a candidate passes before an end, with what follows them.

        That begins at the saddle, or at an attractor that the saddle leads to; the nearest of all these comes first.
        """
        cheapest = {one.end: one for one in sorted(known, key=lambda one: -one.action)}
        firsts = [one for one in cheapest.values() if one.end.saddle >= 0 and one.end is not end]
        if end.saddle < 0 or not firsts:
            return []
        states = self._nodes.resampled(candidate).states
        nodes = states[: _Passage.of(self._from_saddle(end.saddle), states).node]
        passed: list[tuple[_Passage, SolvedPath]] = []
        for first in firsts if len(nodes) > 1 else ():
            saddle = _Passage.of(self._from_saddle(first.end.saddle), nodes)
            if saddle.distance <= _PASSED and not first.end.one_of_many:
                passed.append((saddle, first))
                others = {label for label in first.end.targets if label >= 0} - {candidate.target}
                orbits = sorted(label for label in others if self._problem.structure.attractors[label].repeats)
                passed += [(_Passage.of(self._from_attractor(each), nodes, saddle.node), first) for each in orbits]
        near = sorted((each for each in passed if each[0].distance <= _PASSED), key=lambda each: each[0].distance)
        return [(first, passage.solver, passage.rest(candidate, states)) for passage, first in near]


@dataclasses.dataclass(frozen=True, eq=False)
class _Passage:
    """Where a candidate comes nearest to an orbit."""

    solver: LegSolver  # for legs that leave the orbit
    distance: float  # relative to the candidate's extent
    node: int  # of the candidate
    place: float  # on the orbit

    @classmethod
    def of(cls, solver: LegSolver, nodes: Array, begin: int = 0) -> _Passage:
        """Find the place among the nodes (count, n) from `begin` on."""
        extent = float(np.linalg.norm(np.ptp(nodes, axis=0) / solver.orbit.propagator.units)) or 1.0
        distance, node, place = solver.orbit.closest(nodes, begin)
        return cls(solver, distance / extent, node, place)

    def rest(self, candidate: Candidate, nodes: Array) -> Candidate:
        """Return what of a candidate follows; it is on the orbit from the section before until it leaves."""
        (orbit, phase), propagator = self.solver.orbit.starting(self.place), self.solver.orbit.propagator
        before = self.node % propagator.grain
        states = np.concatenate([orbit.along(phase - before, before + 1), nodes[self.node + 1 :]])
        times = propagator.piece * np.arange(len(states), dtype=float)
        return dataclasses.replace(candidate, times=times, states=states)
