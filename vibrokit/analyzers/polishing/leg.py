"""Exit paths in legs: extremal paths from one closed orbit to an end, and the noise-free motion between them."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.path_ends import PathEnd
from vibrokit.analyzers.paths.candidate import Candidate, same_action
from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.polishing.ends import Nodes, pieces_of
from vibrokit.analyzers.polishing.extremal_path import ExtremalPath
from vibrokit.analyzers.polishing.linearize import linearized_orbit
from vibrokit.analyzers.polishing.path_solver import Effort, PathSolver
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.errors import StructureError
from vibrokit.kernels.single import record, record_each
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.results.energy import ExitPath
from vibrokit.results.saddle import Saddle
from vibrokit.structure.orbits import nodes_from, states_along, unstable_direction
from vibrokit.structure.scales import doublings_of
from vibrokit.symbolic.flow_kind import Flow

_SAMPLES = 128  # in a section interval, more in a long one: enough for pictures, and for quadrature to about 1e-6

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
    return max(_SAMPLES * 2 ** doublings_of(scene), *pieces_of(scene))


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
        for _ in range(4):
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
        raise StructureError("after 4 cuts where it has already left, the path still leaves before its end.")


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


@dataclasses.dataclass(frozen=True, eq=False)
class SolvedPath:
    """A path to an end: one extremal path, or several, one after the other, with orbits between them."""

    legs: tuple[Leg, ...]
    path: ExitPath  # between two legs p = 0 and the action is constant
    finder: str  # the source that proposed it

    @classmethod
    def of(cls, problem: ExitProblem, legs: Sequence[Leg], finder: str) -> SolvedPath:
        """Return the path of some legs.

        Raises StructureError if a leg begins at an attractor that the saddle before does not lead to.
        """
        path = legs[0].path
        for before, after in itertools.pairwise(legs):
            path = _appended(path, _between(problem, before, after), after.path, problem.scene)
        return cls(tuple(legs), path, finder)

    @property
    def end(self) -> PathEnd:
        """Where it ends."""
        return self.legs[-1].end

    @property
    def targets(self) -> tuple[int, ...]:
        """Labels of the attractors that it leads to, without those that its first legs lead to."""
        before = {label for leg in self.legs[:-1] for label in leg.end.targets}
        return tuple(label for label in self.end.targets if label not in before)

    @property
    def action(self) -> float:
        """Of all legs; the motion between them costs nothing."""
        return sum(leg.found.action for leg in self.legs)

    @property
    def through(self) -> tuple[str, ...]:
        """The orbits between the legs, by name."""
        return tuple(leg.left.name for leg in self.legs[1:])

    def is_same(self, other: SolvedPath) -> bool:
        """Return whether two paths are one, shifted in time: of one action, and near each other where half is spent.

        Near is within 0.05 of the extent, because only one of them is compared at its samples.
        """
        one, action = self.path, self.action
        if self.end is not other.end or not same_action(action, other.action):
            return False
        middle = min(int(np.searchsorted(one.action, 0.5 * action)), len(one.t) - 1)
        place = np.concatenate([one.q[middle], one.p[middle]])
        offsets = (np.hstack([other.path.q, other.path.p]) - place) / self.legs[0].found.scale
        return bool(np.abs(offsets).max(axis=1).min() < 0.05)


def _appended(path: ExitPath, between: Array, after: ExitPath, scene: Oscillator) -> ExitPath:
    """The path without its last sample, the states between, and another path that begins one time step later."""
    kept, count, n = len(path.t) - 1, len(between), path.q.shape[1]
    samples = samples_of(scene)
    step = scene.section_interval / samples
    times = path.t[-1] + step * np.arange(count)
    start = path.t[-1] + step * count
    last = kept + count
    sections = [path.section[path.section < kept], kept + np.arange(0, count, samples), last + after.section]
    return ExitPath(
        np.concatenate([path.t[:kept], times, start + after.t - after.t[0]]),
        np.concatenate([path.q[:kept], between, after.q]),
        np.concatenate([path.p[:kept], np.zeros((count, n)), after.p]),
        np.concatenate([path.action[:kept], np.full(count, path.action[-1]), path.action[-1] + after.action]),
        np.concatenate(sections),
    )


def _between(problem: ExitProblem, before: Leg, after: Leg) -> Array:
    """States (count, n) at equal steps from the end of a leg to the start of the next, that one not included."""
    saddle = problem.structure.saddles[before.end.saddle]
    here, there, extent = before.path.q[-1], after.path.q[0], np.ptp(after.path.q, axis=0)
    if after.left.saddle == before.end.saddle:
        return _along(problem.scene, saddle, problem.single_stepper(Flow.STATE), here, there)
    return _relaxation(problem, saddle, after.left, here, there, extent)


def _along(scene: Oscillator, saddle: Saddle, stepper: Stepper, here: Array, there: Array) -> Array:
    """The motion along the orbit of a saddle."""
    nothing, samples = np.empty((0, len(here))), samples_of(scene)
    if saddle.duration == 0:
        return nothing
    if scene.autonomous:
        spacing = scene.section_interval / samples
        count = math.ceil(saddle.duration / spacing)
        orbit = record(scene, Flow.STATE, stepper, saddle.points[0], 0.0, spacing, count)[:count]
        first, last = (_nearest(scene, orbit, state) for state in (here, there))
        return np.roll(orbit, -first, axis=0)[: (last - first) % count]
    first, last = (_nearest(scene, saddle.points, state) for state in (here, there))
    visited = (first + np.arange((last - first) % len(saddle.points))) % len(saddle.points)
    states = states_along(scene, saddle.at_equal_times, saddle.period, stepper, samples)
    return np.concatenate([nothing, *states.reshape(saddle.period, samples, -1)[visited]])


def _relaxation(
    problem: ExitProblem, saddle: Saddle, left: Departure, here: Array, there: Array, extent: Array
) -> Array:
    """The motion from a saddle to an attractor, until it is near the state `there` on the section.

    It begins at 1e-3 of the leg's extent beside the saddle, and ends at 1e-2 of it from the attractor. Both sides are
    followed by turns, for 64 times 64 section intervals at most.
    """
    scene, stepper = problem.scene, problem.single_stepper(Flow.STATE)
    visit, by = _nearest(scene, saddle.points, here), problem.single_stepper(Flow.STATE_VARIATIONAL)
    start, nodes = saddle.points[visit], nodes_from(visit, saddle.nodes, saddle.points)
    direction = unstable_direction(scene, nodes, max(1, saddle.period), by)
    if direction is None:
        raise StructureError(f"motion from the saddle at ({start[0]:.6g}, {start[1]:.6g}) diverges.")
    direction = direction / np.linalg.norm(direction / extent)
    samples, stretch = samples_of(scene), 64
    spacing, every = scene.section_interval / samples, 1 if scene.autonomous else samples
    motions = [start + side * 1e-3 * direction for side in (1, -1)]
    parts: list[list[Array]] = [[], []]
    for _ in range(64):
        for side, state in enumerate(motions):
            motion = record(scene, Flow.STATE, stepper, state, 0.0, spacing, stretch * samples)
            if len(motion) <= stretch * samples:  # it diverged
                continue
            near = np.linalg.norm((motion[::every] - there) / extent, axis=1)
            parts[side].append(motion[:-1])
            if near.min() <= 1e-2:
                parts[side][-1] = motion[: every * int(np.argmax(near <= 1e-2))]
                return np.concatenate(parts[side])
            motions[side] = motion[-1]
    raise StructureError(f"motion from the saddle at ({start[0]:.6g}, {start[1]:.6g}) does not come near {left.name}.")


def _nearest(scene: Oscillator, points: Array, state: Array) -> int:
    """Which of some points is nearest to a state in (x, v)."""
    return int(np.argmin(np.linalg.norm((points - state)[:, :2] / [1.0, scene.reference_frequency], axis=1)))
