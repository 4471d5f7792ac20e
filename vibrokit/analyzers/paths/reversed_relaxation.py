"""Reversed relaxation: motion without noise from the ends of exit paths to an equilibrium, run backwards.

Where damping is linear, noise additive and all other forces derive from a potential, detailed balance holds, and these
are the paths of least action themselves (Freidlin and Wentzell, Random Perturbations of Dynamical Systems, 3rd ed.,
4.3). In any other autonomous scene they are guesses.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.path_ends import AtFace, AtSaddle, PathEnd
from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.kernels.single import record
from vibrokit.kernels.vector_field import VectorField
from vibrokit.results.region import Region
from vibrokit.results.saddle import Saddle
from vibrokit.symbolic.flow_kind import Flow

FINDER = "reversed relaxation"
_NEAR = 1e-4  # of the distance between both ends: so far from them it begins and ends
_BENT = 1e-3  # of the linearized rates: so little others are where the path begins
_AROUND = 2.0  # widths of the region, on each side, within which the motion is followed
_CHUNK, _LASTING, _MOST_SAMPLES = 256, 64, 2**20  # samples: recorded at first, to be linear for, in all

Array = NDArray[np.float64]


def reversed_relaxations(problem: ExitProblem, propagator: SegmentPropagator) -> list[Candidate]:
    """Return a candidate for each saddle and each face of x from which the motion relaxes to the attractor.

    None for attractors that are no equilibria, and for scenes whose noise has its own states. Samples are a piece
    of the propagator apart.
    """
    osc, attractor = problem.scene, problem.attractor
    if not osc.autonomous or attractor.kind != "equilibrium" or propagator.size != 2:
        return []
    found = []
    for end in problem.path_ends:
        for start in _starts(end, problem):
            states = _relaxed(problem, propagator, start, attractor.points[0])
            if states is not None:
                path = states[::-1] * np.array([1.0, -1.0])
                times = np.arange(len(path), dtype=np.float64) * propagator.piece
                momenta, rates = momenta_of(VectorField(osc), path, path * np.array([1.0, -1.0]))
                action = float(np.trapezoid(rates, dx=propagator.piece))
                if np.isfinite(momenta).all():  # noise may vanish somewhere on the way
                    found.append(Candidate(problem.source, end.targets[0], times, path, action, FINDER, momenta))
    return found


def _starts(end: PathEnd, problem: ExitProblem) -> Iterator[Array]:
    """Where the relaxation begins: beside a saddle, on both sides, or at rest on a face."""
    if isinstance(end, AtFace) and end.axis == 0:
        yield np.array([end.level, 0.0])
    if isinstance(end, AtSaddle) and _is_equilibrium(problem.structure.saddles[end.number]):
        point = problem.structure.saddles[end.number].points[0]
        values, vectors = np.linalg.eig(VectorField(problem.scene).jacobian(point))
        unstable = vectors[:, np.argmax(values.real)].real
        offset = problem.attractor.points[0] - point
        length = _NEAR * np.linalg.norm(offset / _units(problem)) / np.linalg.norm(unstable / _units(problem))
        yield from (point + length * unstable, point - length * unstable)


def _relaxed(problem: ExitProblem, propagator: SegmentPropagator, start: Array, goal: Array) -> Array | None:
    """The motion from a start to where it is linear about the equilibrium; None if it does not come there."""
    around, osc, units, field = followed_within(problem), problem.scene, _units(problem), VectorField(problem.scene)
    wanted, jacobian = _NEAR * np.linalg.norm((start - goal) / units), field.jacobian(goal)
    recorded, samples = [start[None]], _CHUNK
    while samples < _MOST_SAMPLES:
        more = record(osc, Flow.STATE, propagator.stepper, recorded[-1][-1], 0.0, propagator.piece, samples)[1:]
        distances = np.linalg.norm((more - goal) / units, axis=1)
        linear = (more - goal) @ jacobian.T
        bent = np.linalg.norm(field.rate(more) - linear, axis=1) > _BENT * np.linalg.norm(linear, axis=1)
        far = np.flatnonzero((distances > wanted) | (bent & (distances > _BENT * wanted)))
        enough = int(far[-1]) + 2 if far.size else 1
        if enough <= len(more) - _LASTING:
            states = np.concatenate([*recorded, more[:enough]])
            return None if problem.is_out(states[1:]).any() else states
        recorded.append(more)
        if not len(more) or not around.contains(more[-1:]).all():  # it has ended, or may never come to rest
            break
        at_rest = np.linalg.norm(np.ptp(more, axis=0) / units) <= wanted  # in another well
        if len(more) < samples or (at_rest and distances[-1] > wanted):
            break
        samples *= 2
    return None


def _is_equilibrium(saddle: Saddle) -> bool:
    return saddle.kind == "saddle" and saddle.duration == 0


def _units(problem: ExitProblem) -> Array:
    return np.array([1.0, problem.scene.reference_frequency])


def followed_within(problem: ExitProblem) -> Region:
    """Return the region within which motion is followed; farther off it may never come to rest."""
    return Region.around(problem.structure.basins.region.bounds.T, _AROUND)


def momenta_of(field: VectorField, path: Array, flipped: Array, time: float | Array = 0.0) -> tuple[Array, Array]:
    """Momenta along a motion run backwards, at a time or at times (s), and the rates at which it costs action.

    The damping acts twice, and noise makes up for it: p₂ = (b₂(x, −v) − b₂(x, v)) / g², the difference of the rates of
    v at the flipped states and at those of the path; p₁ follows from Hamilton's equation for p₂, where the change of g
    is left out.
    """
    along = np.tile([0.0, 1.0], (len(path), 1))
    here, there = field.rate(path, time)[:, 1], field.rate(flipped, time)[:, 1]
    own, opposite = field.jacobian(path, time)[:, 1], field.jacobian(flipped, time)[:, 1]
    squared = field.hamiltonian_rate(path, along, time)[:, 1] - here
    change = (opposite[:, 0] - own[:, 0]) * path[:, 1] - (opposite[:, 1] + own[:, 1]) * there
    with np.errstate(divide="ignore", invalid="ignore"):
        second = (there - here) / squared
        first = -change / squared - own[:, 1] * second
    return np.column_stack([first, second]), 0.5 * squared * second**2
