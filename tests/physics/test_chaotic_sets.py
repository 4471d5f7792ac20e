"""Exits from chaotic attractors through chaotic boundaries: paths that satisfy their equations, by differences."""

import math

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import vibrokit as vk
from tests.scenes import double_well
from vibrokit.results.codes import Code
from vibrokit.results.energy import Bound

pytestmark = pytest.mark.long

DAMPING, FORCE, FREQUENCY = 0.15, 0.3, 1.2


@pytest.fixture(scope="module")
def found():
    """Two chaotic attractors of a double well, each the mirror image of the other half a period later."""
    forces = (vk.Harmonic(amplitude=FORCE, frequency=FREQUENCY),)
    osc = double_well(damping_ratio=DAMPING, excitations=forces, noise=vk.WhiteNoise(1e-6))
    structure = vk.find_structure(osc, manifolds=False)
    assert [each.kind for each in structure.attractors] == ["chaotic", "chaotic"]
    return structure, vk.LeastAction(graph=None).run(osc, structure)


def test_both_attractors_have_a_bound_from_their_closest_approach(found):
    structure, result = found
    assert [(energy.source, energy.target) for energy in result.energies] == [(0, 1), (1, 0)]
    for energy in result.energies:
        assert structure.saddles[energy.saddle].embedded
        assert energy.bound is Bound.BRACKET
        assert 0 == energy.lower < energy.value < 1e-4  # next to a boundary crisis; a kick of 0.014 in v
    assert len(result.found(Code.CHAOTIC_SOURCE)) == len(result.found(Code.CHAOTIC_BOUNDARY)) == 2


def test_the_paths_satisfy_the_equations_of_motion(found):
    structure, result = found
    for energy in result.energies:
        path = energy.path
        x, v, force = path.q[:, 0], path.q[:, 1], path.p[:, 1]
        size = np.abs(force).max()
        missing = CubicSpline(path.t, v)(path.t, 1) - (
            force - 2 * DAMPING * v + x - x**3 + FORCE * np.cos(FREQUENCY * path.t)
        )
        assert np.abs(missing[2:-2]).max() < 1e-2 * size
        assert np.abs(CubicSpline(path.t, x)(path.t, 1) - v)[2:-2].max() < 1e-4 * np.ptp(v)
        spent = 0.5 * CubicSpline(path.t, force**2).integrate(path.t[0], path.t[-1])
        assert spent == pytest.approx(path.action[-1] - path.action[0], rel=1e-4)  # less than in all: beyond both ends
        ends = structure.saddles[energy.saddle].points
        last = path.q[path.section[-1]] if path.section.size else path.q[-1]
        assert np.linalg.norm(ends - last, axis=1).min() < 1e-2
        assert not math.isnan(energy.numerical_error)
