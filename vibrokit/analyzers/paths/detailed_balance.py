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
from vibrokit.symbolic.model import Model

_RELATIVE = 1e-11  # error of the potential energy
_PARTS = 200  # of an interval, at most


def least_actions(problem: ExitProblem) -> dict[int, float]:
    """Return by target what no exit can cost less than; empty where detailed balance does not hold.

    A path passes every x between the equilibrium and its end. So it climbs at least to the highest potential energy
    there, which is that of a saddle or of the end.
    """
    attractor, ends = problem.attractor, problem.path_ends
    if attractor.kind != "equilibrium" or not problem.scene.autonomous:
        return {}
    places = {end: _place(end, problem) for end in ends}
    balance = Model(problem.scene).balance
    if balance is None or not balance > 0 or not all(math.isfinite(place) for place in places.values()):
        return {}
    start = float(attractor.points[0, 0])
    summits = [float(saddle.points[0, 0]) for saddle in problem.structure.saddles]
    least: dict[int, float] = {}
    for end, place in places.items():
        between = [x for x in summits if min(start, place) < x < max(start, place)]
        cost = float(balance) * _highest(problem.scene, [start, *sorted(between, key=lambda x: abs(x - start)), place])
        for target in end.targets:
            least[target] = min(cost, least.get(target, math.inf))
    return least


def _place(end: PathEnd, problem: ExitProblem) -> float:
    """Position where paths to an end end; infinite for one that is not at a position."""
    if isinstance(end, AtFace) and end.axis == 0:
        return end.level
    if isinstance(end, AtSaddle) and problem.structure.saddles[end.number].duration == 0:
        return float(problem.structure.saddles[end.number].points[0, 0])
    if isinstance(end, InBasin) and len(end.targets) == 1 and end.targets[0] >= 0:
        return float(problem.structure.attractors[end.targets[0]].points[0, 0])
    return math.inf


def _highest(scene: Oscillator, places: list[float]) -> float:
    """The highest potential energy at some places, one after the other, above that at the first, less its error."""
    field, energy, highest = VectorField(scene), 0.0, 0.0
    stops = [barrier.position for barrier in scene.barriers]

    def force(x: float) -> float:
        return float(field.rate(np.array([[x, 0.0]]))[0, 1])

    for one, other in itertools.pairwise(places):
        kinks = [x for x in stops if min(one, other) < x < max(one, other)]
        work, error = quad(
            force, one, other, epsabs=0.0, epsrel=_RELATIVE, limit=_PARTS, points=kinks or None, full_output=True
        )[:2]  # it would warn where rounding limits the accuracy
        energy -= work + error
        highest = max(highest, energy)
    return highest
