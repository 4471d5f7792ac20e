"""PassingSearch: exit paths in legs, through an orbit that a candidate passes before its end."""

from __future__ import annotations

import dataclasses
import functools
from collections import Counter
from collections.abc import Iterator, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.path_ends import AtSaddle, PathEnd
from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.polishing.ends import obstacle
from vibrokit.analyzers.polishing.leg import PIECES, Departure, LegSolver, Nodes
from vibrokit.analyzers.polishing.solved_path import SolvedPath
from vibrokit.errors import StructureError
from vibrokit.oscillator import Oscillator

_PASSED = 0.05  # of a candidate's extent: distance from a saddle that it passes; grids place it to 0.01 to 0.03
_NO_FALLBACK = 0.0  # for the least action known: legs that converge do so soon, and others would take minutes
_MOST_FAILURES = 2  # of legs from one orbit to one end, after which no other candidate is tried
_TOO_MUCH = 1.25  # times the candidate's action: searches price a path to a few percent
_WHOLE = 1e-6  # of a section interval: difference of times that are equal


class PassingSearch:
    """Solves for paths that pass one orbit after another.

    The least action may be that of a path through a saddle, and through the attractor that motion from there leads to,
    before the end. It is the sum over its legs, from each of these orbits to the next (Freidlin and Wentzell, "Random
    Perturbations of Dynamical Systems", 6.3). Each leg takes infinite time, so that no single path is found near it.
    """

    def __init__(self, nodes: Nodes) -> None:
        self._nodes, self._problem, structure = nodes, nodes.problem, nodes.problem.structure
        self._failures: Counter[tuple[LegSolver, PathEnd]] = Counter()
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
        """Return a path to an end of which a known path is the first part; None if none is found."""
        for first, solver, rest in self._splits(end, candidate, known):
            if self._failures[solver, end] >= _MOST_FAILURES:
                continue
            try:
                leg = solver.solve(end, rest, least=_NO_FALLBACK)
                if first.action + leg.found.action <= _TOO_MUCH * candidate.action:
                    return SolvedPath.of(self._problem, (*first.legs, leg))
            except StructureError:
                pass
            self._failures[solver, end] += 1
        return None

    def _splits(
        self, end: PathEnd, candidate: Candidate, known: Sequence[SolvedPath]
    ) -> Iterator[tuple[SolvedPath, LegSolver, Candidate]]:
        """Known paths to saddles that a candidate passes before an end, with what follows them.

        That begins at the saddle, or at an attractor that the saddle leads to; the nearest of all these comes first.
        """
        if end.saddle < 0:
            return
        places = _on_section(candidate, self._problem.scene)
        states = candidate.states[places]
        last = int(np.argmin(self._from_saddle(end.saddle).orbit.nearest(states)[0]))
        passed: list[tuple[float, int, SolvedPath, LegSolver]] = []
        for first in _cheapest(known) if last else ():
            if first.end.saddle >= 0 and first.end is not end and not first.end.one_of_many:
                saddle = self._from_saddle(first.end.saddle)
                distance = self._distance(saddle, candidate)
                if distance <= _PASSED:
                    place = int(np.argmin(saddle.orbit.nearest(states[:last])[0]))
                    passed.append((distance, place, first, saddle))
                    passed += [
                        (self._distance(other, candidate), place + near, first, other)
                        for other in self._attractors(first.end, candidate)
                        for near in [int(np.argmin(other.orbit.nearest(states[place:last])[0]))]
                    ]
        for _, place, first, solver in sorted(passed, key=lambda each: each[0]):
            yield first, solver, _after(candidate, places[place])

    def _attractors(self, end: PathEnd, candidate: Candidate) -> list[LegSolver]:
        """Those that an end leads to and a candidate may pass."""
        attractors = [self._problem.structure.attractors[label] for label in end.targets if label >= 0]
        return [
            self._from_attractor(attractor.label)
            for attractor in attractors
            if attractor.repeats and attractor.label != candidate.target
        ]

    def _distance(self, solver: LegSolver, candidate: Candidate) -> float:
        """The least distance of a candidate from an orbit at any phase, relative to the candidate's extent."""
        propagator, orbit = self._nodes.propagators[PIECES[0]], solver.orbit
        states = self._nodes.resampled(candidate).states
        extent = float(np.linalg.norm(np.ptp(states, axis=0) / propagator.units))
        if propagator.osc.autonomous:
            return float(orbit.nearest(states)[0].min()) / extent
        shifts = range(0, orbit.period_nodes, propagator.pieces)
        offsets = [(states - orbit.along(shift, len(states))) / propagator.units for shift in shifts]
        return float(np.linalg.norm(offsets, axis=-1).min()) / extent


def _cheapest(known: Sequence[SolvedPath]) -> list[SolvedPath]:
    """The cheapest path to each end."""
    least = {one.end: one for one in sorted(known, key=lambda one: -one.action)}
    return list(least.values())


def _on_section(candidate: Candidate, scene: Oscillator) -> NDArray[np.intp]:
    """Return which states of a candidate lie on the section; without forcing all do."""
    if scene.autonomous:
        return np.arange(len(candidate.times))
    passed = (candidate.times - candidate.times[0]) / scene.section_interval
    return np.flatnonzero(np.abs(passed - np.round(passed)) <= _WHOLE)


def _after(candidate: Candidate, place: int) -> Candidate:
    """The part of a candidate from one of its states on."""
    return dataclasses.replace(candidate, times=candidate.times[place:], states=candidate.states[place:])
