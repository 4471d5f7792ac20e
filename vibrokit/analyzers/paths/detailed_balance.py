"""Detailed balance: what exits cost at least where all forces but friction derive from a potential.

Without forcing, with constant friction γ and noise a, and all other forces −V′(x), the action of any path is

    S = ½ ∫ (v′ + γv + V′)² dt / a = ½ ∫ (v′ − γv + V′)² dt / a + 2γ/a · [V + ½v²],

and so at least 2γ/a times the energy that it climbs: 4ζω_n ΔV for damping 2ζω_n and noise of unit amplitude. Equality
holds for reversed relaxation (Freidlin and Wentzell, Random Perturbations of Dynamical Systems, 3rd ed., 4.3).
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Sequence

import numpy as np
from scipy.integrate import cumulative_trapezoid, quad

from vibrokit.analyzers.path_ends import AtFace, AtSaddle, InBasin, PathEnd
from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.paths.reversed_relaxation import momenta_of
from vibrokit.analyzers.polishing.leg import samples_of
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.kernels.single import record
from vibrokit.kernels.vector_field import VectorField
from vibrokit.oscillator import Oscillator
from vibrokit.results.energy import ActivationEnergy, Bound, ExitPath
from vibrokit.structure.autonomous import equilibria
from vibrokit.symbolic.flow_kind import Flow

METHOD = "detailed balance"


def least_actions(problem: ExitProblem) -> tuple[ActivationEnergy, ...]:
    """Return for each target what no exit can cost less than; none where detailed balance does not hold.

    A path passes every x between the equilibrium and its end. So it climbs at least to the highest potential energy
    there, which is that of a saddle or of the end. If that is the end of the cheapest way, reversed relaxation from
    there costs as much, and the estimate is exact within its numerical error. Others have no upper bound.
    """
    attractor, ends = problem.attractor, problem.path_ends
    if attractor.kind != "equilibrium" or not problem.scene.autonomous:
        return ()
    places = {end: _place(end, problem) for end in ends}
    balance = problem.scene.model.balance
    if balance is None or not balance > 0 or not all(math.isfinite(place) for place in places.values()):
        return ()
    start = float(attractor.points[0, 0])
    low, high = min([start, *places.values()]), max([start, *places.values()])
    around = 0.01 * (high - low)  # a saddle may be close to the start
    rests = equilibria(problem.scene, low - around, high + around)  # the structure may have been stopped
    summits = [float(rest.point[0]) for rest in rests]
    least: dict[int, ActivationEnergy] = {}
    for end, place in places.items():
        between = [x for x in summits if min(start, place) < x < max(start, place)]
        along = [start, *sorted(between, key=lambda x: abs(x - start)), place]
        energy, error, last = _highest(problem.scene, along)
        value, error = float(balance) * energy, float(balance) * error
        reached = last and isinstance(end, AtSaddle) and end.on_own_boundary and problem.structure.complete
        for target in end.targets:
            if target not in least or value < least[target].value:
                least[target] = ActivationEnergy(
                    source=problem.source,
                    target=target,
                    value=value,
                    lower=max(0.0, value - error),
                    upper=value + error if reached else math.inf,
                    method=METHOD,
                    bound=Bound.EXACT if reached else Bound.ESTIMATE,
                    numerical_error=error,
                    saddle=end.saddle,
                )
    return tuple(least.values())


def with_paths(
    problem: ExitProblem, least: Sequence[ActivationEnergy], relaxations: Sequence[Candidate]
) -> tuple[ActivationEnergy, ...]:
    """Return energies with the reversed relaxation of each that is exact, which is its path of least action.

    Its action is that of the trapezoidal rule between samples.
    """
    found = [(each, _nearest(problem, each, relaxations)) for each in least]
    return tuple(dataclasses.replace(each, path=_path(problem, one)) if one else each for each, one in found)


def _nearest(problem: ExitProblem, energy: ActivationEnergy, relaxations: Sequence[Candidate]) -> Candidate | None:
    """The relaxation from the end of an exact energy whose action is nearest to it; None if none has that action."""
    if energy.bound is not Bound.EXACT:
        return None
    start = float(problem.attractor.points[0, 0])
    ends = (end for end in problem.path_ends if energy.target in end.targets and end.saddle == energy.saddle)
    places = [_place(end, problem) for end in ends]
    among = (
        one
        for one in relaxations
        if any(abs(one.states[-1, 0] - place) <= 1e-3 * abs(start - place) for place in places)
    )
    found = min(among, key=lambda one: abs(one.action - energy.value), default=None)
    return found if found is not None and abs(found.action - energy.value) <= 0.01 * energy.value else None


def _path(problem: ExitProblem, relaxation: Candidate) -> ExitPath:
    """The reversed relaxation with as many samples as polished paths have."""
    scene, stepper, flip = problem.scene, problem.single_stepper(Flow.STATE), np.array([1.0, -1.0])
    duration = float(relaxation.times[-1] - relaxation.times[0])
    samples = samples_of(scene)
    spacing = scene.section_interval / samples
    count = math.ceil(duration / spacing)
    motion = record(scene, Flow.STATE, stepper, relaxation.states[-1] * flip, 0.0, spacing, count)[::-1]
    momenta, rates = momenta_of(VectorField(scene), motion * flip, motion)
    times = spacing * np.arange(len(motion), dtype=np.float64)
    action = np.asarray(cumulative_trapezoid(rates, times, initial=0.0))
    return ExitPath(times, motion * flip, momenta, action, np.arange(0, len(times), samples))


def _place(end: PathEnd, problem: ExitProblem) -> float:
    """Position where paths to an end end; infinite for one that is not at a position."""
    if isinstance(end, AtFace) and end.axis == 0:
        return end.level
    if isinstance(end, AtSaddle) and problem.structure.saddles[end.number].duration == 0:
        return float(problem.structure.saddles[end.number].points[0, 0])
    if isinstance(end, InBasin) and len(end.targets) == 1 and end.targets[0] >= 0:
        return float(problem.structure.attractors[end.targets[0]].points[0, 0])
    return math.inf


def _highest(scene: Oscillator, places: list[float]) -> tuple[float, float, bool]:
    """The highest potential energy at some places in turn, above the first, its error, and whether the last has it."""
    field, energy, total, highest = VectorField(scene), 0.0, 0.0, (0.0, 0.0, False)
    stops = [barrier.position for barrier in scene.barriers]

    def force(x: float) -> float:
        return float(field.rate(np.array([[x, 0.0]]))[0, 1])

    for one, other in itertools.pairwise(places):
        kinks = [x for x in stops if min(one, other) < x < max(one, other)]
        work, error = quad(
            force, one, other, epsabs=0.0, epsrel=1e-11, limit=200, points=kinks or None, full_output=True
        )[:2]  # it would warn where rounding limits the accuracy
        rounding = 1e-15 * scene.reference_frequency**2 * max(abs(one), abs(other)) * abs(other - one)
        energy, total = energy - work, total + error + rounding
        if energy > highest[0]:
            highest = energy, total, other == places[-1]
    return highest
