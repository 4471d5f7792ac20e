"""Reversed relaxation under slow forcing: guesses of exit paths that end on a saddle orbit at various times.

While a forcing hardly changes, a scene is nearly one at rest, and the path of least action is nearly a relaxation from
the saddle to the attractor, run backwards, under the forces at that time. It ends about when the barrier is lowest.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from vibrokit.analyzers.path_ends import AtSaddle
from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.paths.reversed_relaxation import FINDER, followed_within, momenta_of
from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.kernels.vector_field import VectorField
from vibrokit.progress import TRAJECTORIES, advance, current
from vibrokit.results.saddle import Saddle
from vibrokit.structure.orbits import states_along
from vibrokit.structure.scales import doublings_of

_PHASES = 16  # in a section interval, at which paths end at first
_DECAY = math.log(1e3)  # logarithm of the factor by which a deviation from the attractor has fallen
_BESIDE = 1e-4  # of the distance from the saddle to the attractor: so far from the saddle a path ends
_ARRIVED = 0.1  # of that distance: so near to the attractor a path must begin
_PRECISION, _LEAST = 1e-5, 1e-6  # of guesses: relative error of a step, and relative to the size of the motion
_MOST = 2  # for each saddle, the cheapest
_MOST_EVALUATIONS = 40_000  # of the rates of all motions at once: some ten seconds, where contacts are short

Array = NDArray[np.float64]


class _TooManyError(Exception):
    """More evaluations than guesses are worth."""


def slow_relaxations(problem: ExitProblem, propagator: SegmentPropagator) -> list[Candidate]:
    """Return candidates that end on saddle orbits at the times at which they cost least.

    None where the forcing is not slow, for attractors that do not repeat, and for noise with states of its own. Samples
    are a piece of the propagator apart.
    """
    osc, attractor = problem.scene, problem.attractor
    if osc.autonomous or not doublings_of(osc) or not attractor.is_fixed or propagator.size != 2:
        return []
    found: list[Candidate] = []
    for end in problem.path_ends:
        if isinstance(end, AtSaddle) and problem.structure.saddles[end.number].kind == "saddle":
            found += _cheapest(problem, propagator, end)
    return found


def _cheapest(problem: ExitProblem, propagator: SegmentPropagator, end: AtSaddle) -> list[Candidate]:
    """The paths to a saddle whose ends, to a piece, are local minima of the action, the cheapest first.

    Newton's method cannot shift a path in time by more than a fraction of 1/ω_n.
    """
    saddle, step = problem.structure.saddles[end.number], propagator.pieces // _PHASES
    relaxations, pieces = _Relaxations(problem, propagator, end), saddle.period * propagator.pieces
    known: dict[int, Candidate | None] = {}

    def cost(phase: int) -> float:
        path = known[phase % pieces]
        return math.inf if path is None else path.action

    def find(phases: Iterable[int]) -> None:
        new = sorted({phase % pieces for phase in phases} - known.keys())
        known.update(zip(new, relaxations.ending(new), strict=True))

    find(range(0, pieces, step))
    costs = [cost(phase) for phase in range(0, pieces, step)]
    minima = [at for at, here in enumerate(costs) if here <= costs[at - 1] and here < costs[(at + 1) % len(costs)]]
    best, change = [at * step for at in sorted(minima, key=costs.__getitem__)[:_MOST]], step
    while best and (change := change // 2) >= 1:
        near = [(phase, phase - change, phase + change) for phase in best]
        find(phase for three in near for phase in three)
        best = [min(three, key=cost) for three in near]
    found = [known[phase % pieces] for phase in best]
    return [path for path in found if path is not None]


class _Between:
    """The attractor's and a saddle's orbit, and the slow motion between them."""

    def __init__(self, problem: ExitProblem, propagator: SegmentPropagator, saddle: Saddle) -> None:
        osc, attractor, pieces = problem.scene, problem.attractor, propagator.pieces
        own = states_along(osc, attractor.points, attractor.period, propagator.stepper, pieces)
        other = states_along(osc, saddle.at_equal_times, saddle.period, propagator.stepper, pieces)
        self.field = VectorField(osc)
        both = math.lcm(len(own), len(other))
        states = np.hstack([np.tile(states, (both // len(states), 1)) for states in (own, other)])
        sides = np.sign(states[:, 2] - states[:, 0])
        self.beside = bool(np.all(sides == sides[0]))
        times = propagator.piece * np.arange(both + 1)
        self.orbits = CubicSpline(times, np.vstack([states, states[:1]]), bc_type="periodic")

    def attractor(self, time: float) -> Array:
        """Return the state (2,) of the attractor at a time (s)."""
        state: Array = self.orbits(time)[:2]
        return state

    def saddle(self, time: float) -> Array:
        """Return the state (2,) of the saddle's orbit at a time (s)."""
        state: Array = self.orbits(time)[2:]
        return state

    def flipped(self, times: Array, states: Array) -> Array:
        """Return states (count, 2) with their velocities against the slow one reversed.

        On either orbit the slow velocity is that of the orbit, which is then left as it is; between them it depends
        linearly on x. Where the saddle's orbit crosses that of the attractor, it is that of the attractor.
        """
        (x, v), (own_x, own_v, other_x, other_v) = states.T, self.orbits(times).T
        share = (x - own_x) / (other_x - own_x) if self.beside else 0.0
        return np.column_stack([x, 2 * (own_v + share * (other_v - own_v)) - v])

    def rate(self, times: Array, states: Array) -> Array:
        """Return the rates of motion whose damping is reversed."""
        return np.column_stack([states[:, 1], self.field.rate(self.flipped(times, states), times)[:, 1]])


class _Relaxations:
    """Motion from beside a saddle to the attractor, run backwards, to ends at various times: all followed at once."""

    def __init__(self, problem: ExitProblem, propagator: SegmentPropagator, end: AtSaddle) -> None:
        self._problem, self._propagator, self._end = problem, propagator, end
        self._between = _Between(problem, propagator, problem.structure.saddles[end.number])
        self._around = followed_within(problem)

    def ending(self, phases: Sequence[int]) -> list[Candidate | None]:
        """Return the cheaper of both motions for each phase of its end (pieces); None where neither arrives."""
        starts, longest = list[tuple[int, Array, int]](), 0
        for phase in phases:
            beside = self._beside(phase)
            if beside is not None:
                offset, count = beside
                longest = max(longest, count)
                starts += [(phase, offset, count), (phase, -offset, count)]
        found: dict[int, Candidate] = {}
        for (phase, _, count), path in zip(starts, self._carried(starts, longest), strict=True):
            candidate = self._candidate(phase, path[: count + 1][::-1])
            if candidate is not None and (phase not in found or candidate.action < found[phase].action):
                found[phase] = candidate
        return [found.get(phase) for phase in phases]

    def _beside(self, phase: int) -> tuple[Array, int] | None:
        """Where the motion ends, from the saddle, and how many pieces it takes from a section on; None if it cannot."""
        propagator, time = self._propagator, phase * self._propagator.piece
        there = self._between.saddle(time)
        values, vectors = np.linalg.eig(self._between.field.jacobian(there, time))
        if np.iscomplexobj(values) or values.max() <= 0:
            return None
        decay = -float(self._problem.attractor.exponents.real.max())
        least = (_DECAY / decay - math.log(_BESIDE) / float(values.max())) / propagator.piece
        beside = vectors[:, np.argmax(values)] * np.array([1.0, -1.0])
        beside *= _BESIDE * self._distance(time) / np.linalg.norm(beside / propagator.units)
        return beside, phase + propagator.pieces * math.ceil(max(0.0, least - phase) / propagator.pieces)

    def _distance(self, time: float) -> float:
        """The distance from the saddle to the attractor."""
        between = self._between
        return float(np.linalg.norm((between.attractor(time) - between.saddle(time)) / self._propagator.units))

    def _carried(self, starts: Sequence[tuple[int, Array, int]], count: int) -> list[Array]:
        """States (count + 1, 2) of each motion, from its end on backwards; NaN where that takes too many steps.

        A motion that has gone far from the region is not followed, since it may diverge.
        """
        if not starts:
            return []
        between, units, piece = self._between, self._propagator.units, self._propagator.piece
        ends = piece * np.array([phase for phase, _, _ in starts], dtype=np.float64)
        first = np.array([between.saddle(time) + offset for time, (_, offset, _) in zip(ends, starts, strict=True)])
        evaluations, work = itertools.count(1), current()

        def backwards(elapsed: float, flat: Array) -> Array:
            work.check()
            if next(evaluations) > _MOST_EVALUATIONS:
                raise _TooManyError
            states = flat.reshape(-1, 2)
            rates = np.where(self._around.contains(states)[:, None], between.rate(ends - elapsed, states), 0.0)
            return -rates.ravel()

        nothing = np.full((len(starts), count + 1, 2), np.nan)
        goes = {"rtol": _PRECISION, "atol": _LEAST * np.tile(units, len(starts))}
        try:
            with np.errstate(all="ignore"):
                solved = solve_ivp(
                    backwards, (0.0, piece * count), first.ravel(), method="DOP853",
                    t_eval=piece * np.arange(count + 1, dtype=np.float64), **goes,
                )  # fmt: skip
        except _TooManyError:
            return list(nothing)
        advance(len(starts), unit=TRAJECTORIES)
        return list(solved.y.T.reshape(count + 1, -1, 2).transpose(1, 0, 2) if solved.success else nothing)

    def _candidate(self, phase: int, path: Array) -> Candidate | None:
        """A path as a candidate; None if it does not begin near the attractor, or is out before its end."""
        problem, between, piece = self._problem, self._between, self._propagator.piece
        times = piece * np.arange(phase + 1 - len(path), phase + 1, dtype=np.float64)
        if not self._around.contains(path).all() or problem.is_out(path[:-1]).any():
            return None
        away = np.linalg.norm((path[0] - between.attractor(times[0])) / self._propagator.units)
        if away > _ARRIVED * self._distance(phase * piece):
            return None
        momenta, rates = momenta_of(between.field, path, between.flipped(times, path), times)
        action = float(np.trapezoid(rates, times)) if np.isfinite(momenta).all() else math.inf
        return Candidate(problem.source, self._end.targets[0], times - times[0], path, action, FINDER, momenta)
