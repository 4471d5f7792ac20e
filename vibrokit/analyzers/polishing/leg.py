"""Legs of exit paths: extremal paths from one closed orbit to an end, solved for from candidates."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.path_ends import PathEnd
from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.polishing.ends import Nodes
from vibrokit.analyzers.polishing.extremal_path import ExtremalPath
from vibrokit.analyzers.polishing.linearize import linearized_orbit
from vibrokit.analyzers.polishing.path_solver import Effort, PathSolver
from vibrokit.errors import StructureError
from vibrokit.kernels.single import record, record_each
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.results.energy import ExitPath
from vibrokit.results.saddle import Saddle
from vibrokit.structure.scales import doublings_of
from vibrokit.symbolic.flow_kind import Flow

_SAMPLES = 128  # in a section interval, more in a long one: enough for pictures, and for quadrature to about 1e-6
_ROUNDS = 4  # how often a path is cut where it has already left

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


def samples_of(scene: Oscillator) -> int:
    """Return the number of samples of a path in a section interval: a multiple of each number of pieces."""
    return _SAMPLES * 2 ** doublings_of(scene)


class LegSolver:
    """Solves for legs that leave one orbit; raises StructureError if it is not hyperbolic."""

    def __init__(self, nodes: Nodes, left: Departure) -> None:
        self.nodes, self.left = nodes, left
        self.orbit = linearized_orbit(nodes.propagator, left.nodes, left.period, left.duration)
        self._solver: Callable[[PathEnd], PathSolver] = functools.cache(
            lambda end: PathSolver(nodes.propagator, self.orbit)
        )

    @cached_property
    def _finer(self) -> LegSolver:
        return LegSolver(self.nodes.finer, self.left)

    def solve(
        self,
        end: PathEnd,
        candidate: Candidate,
        effort: Effort,
        others: Sequence[PathEnd] = (),  # by which the path must not leave before
        least: float = np.inf,  # action of the known paths to the end
    ) -> Leg:
        """Polish a candidate to an end; with all effort also at finer nodes, if it is cheaper than `least`.

        Raises StructureError if no path to the end is found, or if it leaves by one of the others before.
        """
        try:
            return self._solve(end, candidate, effort, others, least)
        except StructureError:
            if effort < Effort.FROM_ORBIT or candidate.action >= least:
                raise
        return self._finer._solve(end, candidate, effort, others, least)

    def _solve(
        self, end: PathEnd, candidate: Candidate, effort: Effort, others: Sequence[PathEnd], least: float
    ) -> Leg:
        nodes, ending = self.nodes, self.nodes.ending(end)
        for _ in range(_ROUNDS):
            found = self._solver(end).solve(ending.cuts(nodes.resampled(candidate)), effort, least)
            if not found.action > 0:
                raise StructureError(f"the path has the action {found.action:.3g}, so it does not leave the attractor.")
            path = _dense_path(nodes.propagator, found)
            if any(nodes.ending(other).crossing(path) is not None for other in others):
                raise StructureError("the path leaves by another face before its end.")
            crossing = ending.crossing(path)
            if crossing is None:
                return Leg(self.left, end, nodes.propagator, found, path)
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
