"""Reversed relaxation under slow forcing: guesses of exit paths that end on a saddle orbit at various times.

While a forcing hardly changes, a scene is nearly one at rest, and the path of least action is nearly a relaxation from
the saddle to the attractor, run backwards, under the forces at that time. It ends about when the barrier is lowest.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from vibrokit.analyzers.path_ends import AtSaddle
from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.paths.reversed_relaxation import FINDER, momenta_of
from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.kernels.vector_field import VectorField
from vibrokit.structure.orbits import states_along
from vibrokit.structure.scales import doublings_of

_PHASES = 16  # in a section interval, at which paths end
_DECAY = math.log(1e4)  # logarithm of the factor by which a deviation from the attractor has fallen
_BESIDE = 1e-4  # of the distance from the saddle to the attractor: so far from the saddle a path ends
_ARRIVED = 0.1  # of that distance: so near to the attractor a path must begin
_PRECISION = 1e-8  # relative, of guesses
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
    found = []
    for end in problem.path_ends:
        if isinstance(end, AtSaddle) and problem.structure.saddles[end.number].kind == "saddle":
            paths = [_backwards(problem, propagator, end, phase) for phase in _phases(problem, end, propagator)]
            costs = np.array([np.inf if path is None else path.action for path in paths])
            least = (costs <= np.roll(costs, 1)) & (costs < np.roll(costs, -1)) & np.isfinite(costs)
            places = np.flatnonzero(least)
            found += [paths[place] for place in places[np.argsort(costs[places])][:_MOST]]
    return [path for path in found if path is not None]


def _phases(problem: ExitProblem, end: AtSaddle, propagator: SegmentPropagator) -> range:
    """Numbers of pieces from the saddle's first point on, at which paths end."""
    pieces = problem.structure.saddles[end.number].period * propagator.pieces
    return range(0, pieces, propagator.pieces // _PHASES)


def _backwards(problem: ExitProblem, propagator: SegmentPropagator, end: AtSaddle, phase: int) -> Candidate | None:
    """The cheaper of two motions from beside the saddle to the attractor, run backwards; None if neither comes there.

    It begins on the section.
    """
    osc, attractor, saddle = problem.scene, problem.attractor, problem.structure.saddles[end.number]
    piece, pieces, field = propagator.piece, propagator.pieces, VectorField(osc)
    along = states_along(osc, max(saddle.nodes, saddle.points, key=len), saddle.period, propagator.stepper, pieces)
    own = states_along(osc, attractor.points, attractor.period, propagator.stepper, pieces)
    saddle_state, own_state = along[phase], own[phase % len(own)]
    values, vectors = np.linalg.eig(field.jacobian(saddle_state, phase * piece))
    if np.iscomplexobj(values) or values.max() <= 0:
        return None
    decay = -math.log(float(np.abs(attractor.multipliers).max())) / attractor.duration
    least = (_DECAY / decay - math.log(_BESIDE) / float(values.max())) / piece
    count = phase + pieces * math.ceil(max(0.0, least - phase) / pieces)  # pieces, from a section on
    away = float(np.linalg.norm((own_state - saddle_state) / propagator.units))
    unstable = vectors[:, np.argmax(values)] * np.array([1.0, -1.0])
    unstable *= _BESIDE * away / np.linalg.norm(unstable / propagator.units)
    found = []
    for side in (1, -1):
        path = _reversed(field, saddle_state * [1.0, -1.0] + side * unstable, phase * piece, piece, count)
        if path is None or problem.is_out(path[:-1]).any():
            continue
        start = (phase - count) % len(own)
        if np.linalg.norm((path[0] - own[start]) / propagator.units) > _ARRIVED * away:
            continue
        times = piece * np.arange(count + 1, dtype=np.float64)
        parts = [momenta_of(field, state[None], time) for state, time in zip(path, times, strict=True)]
        momenta, rates = (np.concatenate(columns) for columns in zip(*parts, strict=True))
        if np.isfinite(momenta).all():
            action = float(np.trapezoid(rates, dx=piece))
            found.append(Candidate(problem.source, end.targets[0], times, path, action, FINDER, momenta))
    return min(found, key=lambda candidate: candidate.action, default=None)


def _reversed(field: VectorField, start: Array, time: float, piece: float, count: int) -> Array | None:
    """The states (count + 1, 2) of a motion that runs backwards from a time (s), in the order of time.

    Damping acts as in forward motion, and the forcing runs backwards. None if the motion diverges.
    """

    def rate(elapsed: float, state: Array) -> Array:
        return field.rate(state, time - elapsed)

    at = piece * np.arange(count + 1)
    with np.errstate(all="ignore"):
        solved = solve_ivp(rate, (0.0, at[-1]), start, "DOP853", t_eval=at, rtol=_PRECISION, atol=_PRECISION)
    if not solved.success or not np.isfinite(solved.y).all():
        return None
    path: Array = solved.y.T[::-1] * np.array([1.0, -1.0])
    return path
