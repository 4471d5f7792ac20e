"""Detailed balance: what exits cost at least where all forces but friction derive from a potential.

Without forcing, with constant friction γ and noise a, and all other forces −V′(x), the action of any path is

    S = ½ ∫ (v′ + γv + V′)² dt / a = ½ ∫ (v′ − γv + V′)² dt / a + 2γ/a · [V + ½v²],

and so at least 2γ/a times the energy that it climbs: 4ζω_n ΔV for damping 2ζω_n and noise of unit amplitude. Equality
holds for reversed relaxation (Freidlin and Wentzell, Random Perturbations of Dynamical Systems, 3rd ed., 4.3).
"""

from __future__ import annotations

import itertools
import math

import numpy as np
from scipy.integrate import quad

from vibrokit.analyzers.path_ends import AtFace, AtSaddle, InBasin, PathEnd
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.kernels.vector_field import VectorField
from vibrokit.oscillator import Oscillator
from vibrokit.results.energy import ActivationEnergy, Bound
from vibrokit.symbolic.model import Model

METHOD = "detailed balance"
_RELATIVE = 1e-11  # error of the potential energy
_PARTS = 200  # of an interval, at most


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
    balance = Model(problem.scene).balance
    if balance is None or not balance > 0 or not all(math.isfinite(place) for place in places.values()):
        return ()
    start = float(attractor.points[0, 0])
    summits = [float(saddle.points[0, 0]) for saddle in problem.structure.saddles]
    least: dict[int, ActivationEnergy] = {}
    for end, place in places.items():
        between = [x for x in summits if min(start, place) < x < max(start, place)]
        along = [start, *sorted(between, key=lambda x: abs(x - start)), place]
        energy, error, last = _highest(problem.scene, along)
        value, error = float(balance) * energy, float(balance) * error
        reached = last and isinstance(end, AtSaddle) and end.on_own_boundary
        for target in end.targets:
            if target not in least or value < least[target].value:
                least[target] = ActivationEnergy(
                    source=problem.source,
                    target=target,
                    value=value,
                    lower=max(0.0, value - error),
                    upper=value + error if reached else math.inf,
                    method=METHOD,
                    bound=Bound.ESTIMATE,
                    numerical_error=error,
                    saddle=end.saddle,
                )
    return tuple(least.values())


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
            force, one, other, epsabs=0.0, epsrel=_RELATIVE, limit=_PARTS, points=kinks or None, full_output=True
        )[:2]  # it would warn where rounding limits the accuracy
        energy, total = energy - work, total + error
        if energy > highest[0]:
            highest = energy, total, other == places[-1]
    return highest
