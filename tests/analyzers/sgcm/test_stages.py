"""Committors that guide simulations: rough, but right where symmetry decides."""

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

import vibrokit as vk
from tests.scenes import double_well
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.analyzers.sgcm.stages import committor_stages


@pytest.fixture(scope="module")
def problem():
    osc = double_well(noise=vk.WhiteNoise(intensity=1e-2))
    structure = vk.find_structure(osc, cells=(40, 40), manifolds=False, rng=0)
    return ExitProblem(osc, structure, structure.attractors[0], vk.LeaveBasin())


def at(stages, place):
    """The committor on the section."""
    places = stages.grid.places(np.array([place])).T
    return float(map_coordinates(np.exp(stages.log_values[0]), places, order=1)[0])


@pytest.mark.slow
def test_both_wells_are_reached_alike_from_the_saddle(problem):
    stages = committor_stages(problem, 1e-2)
    assert stages.intensity == 1e-2
    assert at(stages, (0.0, 0.0)) == pytest.approx(0.5, abs=0.05)
    assert at(stages, (1.0, 0.0)) == pytest.approx(1.0, abs=0.01)
    assert at(stages, (-1.0, 0.0)) < 0.05  # ΔU/D = 5


@pytest.mark.long
def test_more_noise_is_used_where_a_density_is_too_narrow(problem):
    stages = committor_stages(problem, 1e-7)
    assert stages.intensity > 1e-7
    assert at(stages, (0.0, 0.0)) == pytest.approx(0.5, abs=0.1)
