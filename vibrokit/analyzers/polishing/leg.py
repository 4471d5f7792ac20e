"""Legs of exit paths: extremal paths from one closed orbit to an end, solved for from candidates."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.path_ends import PathEnd
from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.polishing.ending import Ending, ResampledCandidate, resampled
from vibrokit.analyzers.polishing.ends import ending_at
from vibrokit.analyzers.polishing.extremal_path import ExtremalPath
from vibrokit.analyzers.polishing.linearize import linearized_orbit
from vibrokit.analyzers.polishing.linearized_orbit import LinearizedOrbit
from vibrokit.analyzers.polishing.path_solver import Effort, PathSolver
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.errors import StructureError
from vibrokit.kernels.single import record, record_each
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.results.energy import ExitPath
from vibrokit.results.saddle import Saddle
from vibrokit.structure.scales import doublings_of
from vibrokit.symbolic.flow_kind import Flow

_PIECES = (8, 16)  # in a section interval, more in a long one: the finer ones where the coarser ones do not converge
_SAMPLES = 128  # in a section interval, more in a long one: enough for pictures, and for quadrature to about 1e-6
_ROUNDS = 4  # how often a path is cut where it has already left
_CHEAPER = 1e-3  # of the least action known: a path that much cheaper is worth the costly fallback of `PathSolver`

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class Departure:
    """A closed orbit that paths leave: the attractor, an orbit inside it, or one that a path passes on its way."""

    name: str
    nodes: Array  # (count, n): one of its points on the section, or several states from one on
    period: int  # in section intervals
    duration: float  # time after which it repeats (s); 0 for an equilibrium
    saddle: int = -1  # which of the structure's saddles it is; −1 for none

    @classmethod
    def from_attractor(cls, attractor: Attractor) -> Departure:
        """Return an attractor that repeats."""
        return cls(attractor.name, attractor.points[:1], attractor.period, attractor.duration)

    @classmethod
    def from_saddle(cls, number: int, saddle: Saddle) -> Departure:
        """Return one of the structure's saddles, which is no chaotic set."""
        return cls(f"saddle {number}", saddle.nodes, saddle.period, saddle.duration, number)


@dataclasses.dataclass(frozen=True, eq=False)
class Leg:
    """An extremal path from an orbit to an end, at its nodes (`found`) and between them (`path`)."""

    left: Departure
    end: PathEnd
    propagator: SegmentPropagator
    found: ExtremalPath
    path: ExitPath


def pieces_of(scene: Oscillator) -> tuple[int, ...]:
    """Return the numbers of pieces of a section interval that paths are solved with, in turn."""
    return tuple(pieces * 2 ** doublings_of(scene) for pieces in _PIECES)


def samples_of(scene: Oscillator) -> int:
    """Return the number of samples of a path in a section interval: a multiple of each number of pieces."""
    return _SAMPLES * 2 ** doublings_of(scene)


class Nodes:
    """Candidates at the nodes of paths, and the conditions of ends there, each made once."""

    def __init__(self, problem: ExitProblem) -> None:
        stepper = problem.single_stepper(Flow.HAMILTONIAN_VARIATIONAL)
        self.problem = problem
        self.pieces = pieces_of(problem.scene)
        self.propagators = {pieces: SegmentPropagator(problem.scene, stepper, pieces) for pieces in self.pieces}
        self._resampled = functools.cache(lambda candidate, pieces: resampled(self.propagators[pieces], candidate))
        self._ending = functools.cache(lambda end, pieces: ending_at(end, problem, self.propagators[pieces]))

    def resampled(self, candidate: Candidate, pieces: int | None = None) -> ResampledCandidate:
        """Return a candidate at the nodes; raises StructureError as `ending.resampled` does."""
        found: ResampledCandidate = self._resampled(candidate, pieces or self.pieces[0])
        return found

    def ending(self, end: PathEnd, pieces: int | None = None) -> Ending:
        """Return the conditions of an end; raises StructureError if it is a saddle that is not hyperbolic."""
        found: Ending = self._ending(end, pieces or self.pieces[0])
        return found

    def distance(self, end: PathEnd, candidate: Candidate) -> float:
        """Return how near a candidate comes to an end."""
        return self.ending(end).distance(self.resampled(candidate))


class LegSolver:
    """Solves for legs that leave one orbit; raises StructureError if it is not hyperbolic."""

    def __init__(self, nodes: Nodes, left: Departure) -> None:
        self.nodes, self.left = nodes, left
        self._source = functools.cache(
            lambda pieces: linearized_orbit(nodes.propagators[pieces], left.nodes, left.period, left.duration)
        )
        self._source(self.nodes.pieces[0])
        self._solver = functools.cache(lambda end, pieces: PathSolver(nodes.propagators[pieces], self._source(pieces)))

    @property
    def orbit(self) -> LinearizedOrbit:
        """The orbit that is left."""
        found: LinearizedOrbit = self._source(self.nodes.pieces[0])
        return found

    def solve(
        self,
        end: PathEnd,
        candidate: Candidate,
        *,
        others: Iterable[PathEnd] = (),
        least: float = np.inf,
        effort: Effort = Effort.FROM_ORBIT,
    ) -> Leg:
        """Polish a candidate to an end; with all effort also in finer pieces, if it is cheaper than `least`.

        Raises StructureError if no path to the end is found, or if it leaves by one of the others before.
        """
        for pieces in self.nodes.pieces:
            try:
                return self._solve_with(pieces, end, candidate, others, (1 - _CHEAPER) * least, effort)
            except StructureError as error:
                failure = error
                if effort < Effort.FROM_ORBIT or candidate.action >= least:
                    break
        raise failure

    def _solve_with(
        self, pieces: int, end: PathEnd, candidate: Candidate, others: Iterable[PathEnd], worth: float, effort: Effort
    ) -> Leg:
        solver: PathSolver = self._solver(end, pieces)
        ending = self.nodes.ending(end, pieces)
        for _ in range(_ROUNDS):
            found = solver.solve(ending.cuts(self.nodes.resampled(candidate, pieces)), effort, worth)
            if not found.action > 0:
                raise StructureError(f"the path has the action {found.action:.3g}, so it does not leave the attractor.")
            path = _dense_path(solver.propagator, found)
            if any(self.nodes.ending(other, pieces).crossing(path) is not None for other in others):
                raise StructureError("the path leaves by another face before its end.")
            crossing = ending.crossing(path)
            if crossing is None:
                return Leg(self.left, end, solver.propagator, found, path)
            inside = slice(crossing + 1)
            candidate = dataclasses.replace(
                candidate, times=path.t[inside], states=path.q[inside], momenta=path.p[inside]
            )  # fmt: skip
        raise StructureError(f"after {_ROUNDS} cuts where it has already left, the path still leaves before its end.")


def _dense_path(propagator: SegmentPropagator, found: ExtremalPath) -> ExitPath:
    """Record a path piece by piece, each from its own node; the time is 0 at the start, which is on the section."""
    interval = samples_of(propagator.osc)
    each, n, piece = interval // propagator.pieces, propagator.size, propagator.piece
    actions = found.head + np.concatenate([[0.0], np.cumsum(found.actions)])
    nodes = np.column_stack([found.points[:-1], actions[:-1]])
    phases = (found.first + np.arange(len(nodes))) % propagator.pieces
    by = propagator.osc, Flow.HAMILTONIAN, propagator.stepper
    samples = record_each(*by, nodes[:-1], phases[:-1] * each, piece / each, each)[:, :-1].reshape(-1, nodes.shape[1])
    last = record(*by, nodes[-1], phases[-1] * piece, found.last / each, each)[:-1]
    z = np.vstack([samples, last, np.append(found.points[-1], actions[-1])])
    start = piece * (len(nodes) - 1)
    t = np.concatenate([piece / each * np.arange(len(samples)), start + found.last / each * np.arange(len(last) + 1)])
    section = np.arange(0, len(z) - (found.last != piece), interval)
    return ExitPath(t, z[:, :n], z[:, n : 2 * n], z[:, -1], section)
