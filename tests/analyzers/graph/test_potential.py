"""Potential, seeds and traced paths of the linear oscillator without forcing."""

import numpy as np
import pytest

from tests.analyzers.graph import linear
from vibrokit.analyzers.graph.grids import Grids
from vibrokit.analyzers.graph.potential import ValueIteration, seeds
from vibrokit.analyzers.graph.step_model import StepModel
from vibrokit.analyzers.graph.tracing import backtrack
from vibrokit.kernels.rk4 import RK4

STEP = np.pi / 4
GRIDS = Grids(np.array([[[-1.5, 1.5], [-1.5, 1.5]]]), (61, 61), STEP, 8)
DAMPINGS = (0.1, 0.7)


@pytest.fixture(params=DAMPINGS, scope="module")
def solved(request):
    model = StepModel(linear.oscillator(request.param), RK4(256))
    (attractor,) = linear.structure(request.param).attractors
    ceiling = linear.potential(request.param, 1.0, np.array([1.2, 0.0]))
    return request.param, model, attractor, ValueIteration(model, attractor, GRIDS).up_to(ceiling)


def test_seeds_are_the_quadratic_form_on_an_ellipse(solved):
    damping, model, attractor, _ = solved
    (values,) = seeds(model, attractor, GRIDS).values
    known = np.isfinite(values)
    exact = linear.potential(damping, 1.0, GRIDS.nodes(0))
    assert 16 <= known.sum() <= 64  # 2.6 nodes to each side
    assert exact[known].max() < exact[~known].min()
    np.testing.assert_allclose(values[known], exact[known], rtol=1e-6, atol=1e-12)


def test_the_potential_is_the_quadratic_form_up_to_the_ceiling(solved):
    damping, _, _, potential = solved
    exact = linear.potential(damping, 1.0, GRIDS.nodes(0))
    low = exact < 0.8 * potential.ceiling
    assert np.abs(potential.values[0] - exact)[low].max() < 0.01 * potential.ceiling
    assert potential.values[0].max() == potential.ceiling
    inside = np.array([[0.3, 0.4], [0.61, -0.22]])
    assert potential.at(0, inside) == pytest.approx(
        linear.potential(damping, 1.0, inside), abs=0.01 * potential.ceiling
    )
    assert np.isnan(potential.at(0, np.array([[1.6, 0.0]]))).all()


def test_rise_and_fall_near_a_state(solved):
    damping, _, _, potential = solved
    state, exact = np.array([0.6, 0.0]), lambda x, v: linear.potential(damping, 1.0, np.array([x, v]))
    apart = GRIDS.spacing(0)
    assert potential.rise(0, state) == pytest.approx(
        exact(0.6 + 2 * apart[0], 2 * apart[1]) - exact(0.6, 0.0), abs=0.02 * potential.ceiling
    )
    assert potential.fall(0, state, np.array([0.1, 0.0])) == pytest.approx(
        exact(0.6, 0.0) - exact(0.5, 0.0), abs=0.02 * potential.ceiling
    )


@pytest.mark.parametrize("end", [(0.8, 0.3), (-0.2, 0.9)])
def test_the_path_is_the_relaxation_seen_backwards(solved, end):
    """Without forcing, paths of least action are time-reversed relaxations with the velocity turned round."""
    _, model, _, potential = solved
    found = backtrack(model, potential, np.array(end))
    assert found is not None
    states, value = found
    assert value >= 0.0
    assert states[-1] == pytest.approx(end)
    back = np.array([end]) * [1.0, -1.0]
    for state in states[:-6:-1]:
        assert state == pytest.approx(back[0] * [1.0, -1.0], abs=0.05)
        back = model.images(back, 0.0, STEP)
    assert np.linalg.norm(states[0]) < 0.2
