"""Reversed relaxation under slow forcing: guesses of exit paths that end on a saddle orbit at various times.

While a forcing hardly changes, a scene is nearly one at rest, and the path of least action is nearly a relaxation from
the saddle to the attractor, run backwards, under the forces at that time. It ends about when the barrier is lowest.
"""

from __future__ import annotations

import functools
import math

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from vibrokit.analyzers.path_ends import AtSaddle
from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.paths.reversed_relaxation import FINDER, momenta_of
from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.kernels.vector_field import VectorField
from vibrokit.progress import TRAJECTORIES, advance
from vibrokit.results.saddle import Saddle
from vibrokit.structure.orbits import states_along
from vibrokit.structure.scales import doublings_of

_PHASES = 16  # in a section interval, at which paths end at first
_DECAY = math.log(1e3)  # logarithm of the factor by which a deviation from the attractor has fallen
_BESIDE = 1e-4  # of the distance from the saddle to the attractor: so far from the saddle a path ends
_ARRIVED = 0.1  # of that distance: so near to the attractor a path must begin
_PRECISION, _LEAST = 1e-5, 1e-6  # of guesses: relative error of a step, and relative to the size of the motion
_MOST = 2  # for each saddle, the cheapest

Array = NDArray[np.float64]


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
    between, pieces = _Between(problem, propagator, saddle), saddle.period * propagator.pieces

    @functools.cache
    def ending(phase: int) -> Candidate | None:
        return _backwards(problem, propagator, end, between, phase)

    def cost(phase: int) -> float:
        path = ending(phase % pieces)
        return math.inf if path is None else path.action

    costs = [cost(phase) for phase in range(0, pieces, step)]
    minima = [at for at, here in enumerate(costs) if here <= costs[at - 1] and here < costs[(at + 1) % len(costs)]]
    found = []
    for at in sorted(minima, key=costs.__getitem__)[:_MOST]:
        phase, change = at * step, step
        while (change := change // 2) >= 1:
            phase = min((phase, phase - change, phase + change), key=cost)
        found.append(ending(phase % pieces))
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

    def flipped(self, time: float, state: Array) -> Array:
        """Return a state with its velocity against the slow one reversed.

        On either orbit the slow velocity is that of the orbit, which is then left as it is; between them it depends
        linearly on x. Where the saddle's orbit crosses that of the attractor, it is that of the attractor.
        """
        (x, v), (own_x, own_v, other_x, other_v) = state, self.orbits(time)
        share = (x - own_x) / (other_x - own_x) if self.beside else 0.0
        return np.array([x, 2 * (own_v + share * (other_v - own_v)) - v])

    def rate(self, time: float, state: Array) -> Array:
        """Return the rate of a motion whose damping is reversed."""
        return np.array([state[1], self.field.rate(self.flipped(time, state), time)[1]])


def _backwards(
    problem: ExitProblem, propagator: SegmentPropagator, end: AtSaddle, between: _Between, phase: int
) -> Candidate | None:
    """The cheaper of two motions from beside the saddle to the attractor, run backwards; None if neither comes there.

    It begins on the section.
    """
    attractor, piece, pieces = problem.attractor, propagator.piece, propagator.pieces
    time = phase * piece
    there = between.saddle(time)
    values, vectors = np.linalg.eig(between.field.jacobian(there, time))
    if np.iscomplexobj(values) or values.max() <= 0:
        return None
    decay = -float(attractor.exponents.real.max())
    least = (_DECAY / decay - math.log(_BESIDE) / float(values.max())) / piece
    count = phase + pieces * math.ceil(max(0.0, least - phase) / pieces)  # pieces, from a section on
    away = float(np.linalg.norm((between.attractor(time) - there) / propagator.units))
    beside = vectors[:, np.argmax(values)] * np.array([1.0, -1.0])
    beside *= _BESIDE * away / np.linalg.norm(beside / propagator.units)
    times = time - piece * np.arange(count, -1, -1, dtype=np.float64)
    found = []
    for start in (there + beside, there - beside):
        path = _carried(between, start, times, propagator.units)
        if path is None or problem.is_out(path[:-1]).any():
            continue
        if np.linalg.norm((path[0] - between.attractor(times[0])) / propagator.units) <= _ARRIVED * away:
            found.append(_candidate(problem, end, between, times, path))
    return min(found, key=lambda candidate: candidate.action, default=None)


def _carried(between: _Between, start: Array, times: Array, units: Array) -> Array | None:
    """The states at times (count,) of a motion that ends at a start, followed backwards; None if it diverges."""
    advance(unit=TRAJECTORIES)
    goes = {"method": "LSODA", "t_eval": times[::-1], "rtol": _PRECISION, "atol": _LEAST * units}
    with np.errstate(all="ignore"):
        solved = solve_ivp(between.rate, (times[-1], times[0]), start, **goes)
    if not solved.success or not np.isfinite(solved.y).all():
        return None
    path: Array = solved.y.T[::-1]
    return path


def _candidate(problem: ExitProblem, end: AtSaddle, between: _Between, times: Array, path: Array) -> Candidate:
    parts = [
        momenta_of(between.field, state[None], between.flipped(time, state)[None], time)
        for state, time in zip(path, times, strict=True)
    ]
    momenta, rates = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    action = float(np.trapezoid(rates, times)) if np.isfinite(momenta).all() else math.inf
    return Candidate(problem.source, end.targets[0], times - times[0], path, action, FINDER, momenta)
