"""Reversed relaxation under slow forcing: guesses of exit paths that end on a saddle orbit at various times.

While a forcing hardly changes, a scene is nearly one at rest, and the path of least action is nearly a relaxation from
the saddle to the attractor, run backwards, under the forces at that time. It ends about when the barrier is lowest.
"""

from __future__ import annotations

import contextlib
import itertools
import math
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.ndimage import minimum_filter1d

from vibrokit.analyzers.path_ends import AtSaddle
from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.paths.reversed_relaxation import FINDER, followed_within, momenta_of
from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.kernels.vector_field import VectorField
from vibrokit.progress import TRAJECTORIES, advance, current
from vibrokit.structure.orbits import states_along
from vibrokit.structure.scales import doublings_of

_APART = 16  # of the section interval: nearer to each other, only the cheapest path is kept
_DECAY = math.log(1e3)  # logarithm of the factor by which a deviation from the attractor has fallen
_BESIDE = 1e-4  # of the distance from the saddle to the attractor: so far from the saddle a path ends
_PRECISION, _LEAST = 1e-5, 1e-6  # of guesses: relative error of a step, and relative to the size of the motion
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
    ends = [end for end in problem.path_ends if isinstance(end, AtSaddle)]
    saddles = [end for end in ends if problem.structure.saddles[end.number].kind == "saddle"]
    return [path for end in saddles for path in _Relaxations(problem, propagator, end).cheapest()]


class _Relaxations:
    """Motion from beside a saddle to the attractor, run backwards, to ends at all times: all followed at once."""

    def __init__(self, problem: ExitProblem, propagator: SegmentPropagator, end: AtSaddle) -> None:
        osc, attractor, pieces = problem.scene, problem.attractor, propagator.pieces
        saddle = problem.structure.saddles[end.number]
        self._problem, self._propagator, self._end = problem, propagator, end
        self._field, self._around, self._phases = VectorField(osc), followed_within(problem), saddle.period * pieces
        own = states_along(osc, attractor.points, attractor.period, propagator.stepper, pieces)
        other = states_along(osc, saddle.at_equal_times, saddle.period, propagator.stepper, pieces)
        both = math.lcm(len(own), len(other))
        states = np.hstack([np.tile(states, (both // len(states), 1)) for states in (own, other)])
        self._aside = len(set(np.sign(states[:, 2] - states[:, 0]))) == 1  # one orbit is always beside the other
        times = propagator.piece * np.arange(both + 1)
        self._orbits = CubicSpline(times, np.vstack([states, states[:1]]), bc_type="periodic")

    def cheapest(self) -> list[Candidate]:
        """Return the paths whose ends, to a piece, are local minima of the action, the cheapest first.

        Newton's method cannot shift a path in time by more than a fraction of 1/ω_n.
        """
        found = self._ending()
        costs = np.array([found[phase].action if phase in found else math.inf for phase in range(self._phases)])
        least = minimum_filter1d(costs, 2 * (self._propagator.pieces // _APART) + 1, mode="wrap")
        minima = np.flatnonzero((costs == least) & np.isfinite(costs))
        return [found[at] for at in sorted(minima.tolist(), key=costs.__getitem__)[:2]]

    def _ending(self) -> dict[int, Candidate]:
        """The cheaper of both motions by the phase of its end (pieces), where one arrives."""
        beside = {phase: self._beside(phase) for phase in range(self._phases)}
        starts = [(phase, side * one[0], one[1]) for phase, one in beside.items() if one for side in (1, -1)]
        found: dict[int, Candidate] = {}
        for (phase, _, count), path in zip(starts, self._carried(starts), strict=True):
            candidate = self._candidate(phase, path[: count + 1][::-1])
            if candidate is not None and (phase not in found or candidate.action < found[phase].action):
                found[phase] = candidate
        return found

    def _flipped(self, times: Array, states: Array) -> Array:
        """States (count, 2) with their velocities against the slow one reversed.

        On either orbit the slow velocity is that of the orbit, which is then left as it is; between them it depends
        linearly on x. Where the saddle's orbit crosses that of the attractor, it is that of the attractor.
        """
        (x, v), (own_x, own_v, other_x, other_v) = states.T, self._orbits(times).T
        share = (x - own_x) / (other_x - own_x) if self._aside else 0.0
        return np.column_stack([x, 2 * (own_v + share * (other_v - own_v)) - v])

    def _beside(self, phase: int) -> tuple[Array, int] | None:
        """Where the motion ends, from the saddle, and how many pieces it takes from a section on; None if it cannot."""
        propagator, time = self._propagator, phase * self._propagator.piece
        there = self._orbits(time)[2:]
        values, vectors = np.linalg.eig(self._field.jacobian(there, time))
        if np.iscomplexobj(values) or values.max() <= 0:
            return None
        decay = -float(self._problem.attractor.exponents.real.max())
        least = (_DECAY / decay - math.log(_BESIDE) / float(values.max())) / propagator.piece
        beside = vectors[:, np.argmax(values)] * np.array([1.0, -1.0])
        beside *= _BESIDE * self._distance(time) / np.linalg.norm(beside / propagator.units)
        return beside, phase + propagator.pieces * math.ceil(max(0.0, least - phase) / propagator.pieces)

    def _distance(self, time: float) -> float:
        """The distance from the saddle to the attractor."""
        own, other = np.split(self._orbits(time), 2)
        return float(np.linalg.norm((own - other) / self._propagator.units))

    def _carried(self, starts: Sequence[tuple[int, Array, int]]) -> Iterable[Array]:
        """States (count, 2) of each motion, from its end on backwards; NaN where that takes too many steps.

        A motion that has gone far from the region is not followed, since it may diverge.
        """
        if not starts:
            return ()
        count = max(count for _, _, count in starts)
        units, piece = self._propagator.units, self._propagator.piece
        ends = piece * np.array([phase for phase, _, _ in starts], dtype=np.float64)
        first = self._orbits(ends)[:, 2:] + np.array([offset for _, offset, _ in starts])
        evaluations, work = itertools.count(1), current()

        def backwards(elapsed: float, flat: Array) -> Array:
            work.check()
            if next(evaluations) > _MOST_EVALUATIONS:
                raise _TooManyError
            states, times = flat.reshape(-1, 2), ends - elapsed
            forces = self._field.rate(self._flipped(times, states), times)[:, 1]
            rates = np.column_stack([states[:, 1], forces])
            return -np.where(self._around.contains(states)[:, None], rates, 0.0).ravel()

        times = piece * np.arange(count + 1, dtype=np.float64)
        goes = {"rtol": _PRECISION, "atol": _LEAST * np.tile(units, len(starts))}
        with np.errstate(all="ignore"), contextlib.suppress(_TooManyError):
            solved = solve_ivp(backwards, times[[0, -1]], first.ravel(), method="DOP853", t_eval=times, **goes)
            if solved.success:
                advance(len(starts), unit=TRAJECTORIES)
                states: Array = solved.y.T.reshape(count + 1, -1, 2).transpose(1, 0, 2)
                return states
        return np.full((len(starts), count + 1, 2), np.nan)

    def _candidate(self, phase: int, path: Array) -> Candidate | None:
        """A path as a candidate; None if it does not begin near the attractor, or is out before its end."""
        problem, piece = self._problem, self._propagator.piece
        times = piece * np.arange(phase + 1 - len(path), phase + 1, dtype=np.float64)
        if not self._around.contains(path).all() or problem.is_out(path[:-1]).any():
            return None
        away = np.linalg.norm((path[0] - self._orbits(times[0])[:2]) / self._propagator.units)
        if away > 0.1 * self._distance(phase * piece):
            return None
        momenta, rates = momenta_of(self._field, path, self._flipped(times, path), times)
        action = float(np.trapezoid(rates, times)) if np.isfinite(momenta).all() else math.inf
        return Candidate(problem.source, self._end.targets[0], times - times[0], path, action, FINDER, momenta)
