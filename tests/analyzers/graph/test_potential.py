"""Potential, seeds and traced paths of the linear oscillator without forcing."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from tests.analyzers.graph import linear
from vibrokit.analyzers.graph import value_iteration
from vibrokit.analyzers.graph.grids import Grids
from vibrokit.analyzers.graph.seeds import seeds
from vibrokit.analyzers.graph.step_model import StepModel
from vibrokit.analyzers.graph.tracing import backtrack
from vibrokit.analyzers.graph.value_iteration import ValueIteration
from vibrokit.kernels.fixed_steps import RK4

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


def test_steps_are_needed_only_where_a_rougher_grid_is_below_its_ceiling(solved):
    damping, model, attractor, whole = solved
    level = 0.25 * whole.ceiling
    rougher = ValueIteration(model, attractor, GRIDS.with_shape((31, 31))).up_to(level)
    (near,) = rougher.reached(GRIDS, 1.2 * level)
    exact = linear.potential(damping, 1.0, GRIDS.nodes(0))
    assert near[exact < level].all()
    assert not near[exact > 4 * level].any()
    iteration = ValueIteration(model, attractor, GRIDS, [near])
    assert np.array_equal(np.isfinite(iteration.roots[0]).all(axis=2), near)
    part, every = iteration.up_to(level), ValueIteration(model, attractor, GRIDS).up_to(level)
    np.testing.assert_allclose(part.values[0], every.values[0], rtol=1e-4)


def test_all_nodes_count_as_reached_outside_a_grid_and_at_other_phases(solved):
    _, model, attractor, _ = solved
    inner = dataclasses.replace(GRIDS, boxes=0.5 * GRIDS.boxes)
    small = ValueIteration(model, attractor, inner).up_to(1e-3)
    (near,) = small.reached(GRIDS, 1.0)
    assert near[0].all()
    assert near[:, -1].all()
    assert not near[16, 16]
    other = dataclasses.replace(GRIDS, boxes=np.tile(GRIDS.boxes, (8, 1, 1)))
    assert all(each.all() for each in small.reached(other, 1.0))


def test_a_path_that_never_comes_closer_to_the_attractor_is_given_up(solved):
    """In a hollow of V that interpolation makes; the weight of V against a step is raised 2¹⁴ times in vain."""
    _, model, _, potential = solved
    hollow = dataclasses.replace(
        potential,
        values=[np.full(GRIDS.shape, 1.0)],
        seeded=np.zeros(GRIDS.shape, dtype=bool),
        orbit=np.empty((0, 2)),
    )
    steps = []
    counting = SimpleNamespace(into=lambda *given: steps.append(given) or model.into(*given))
    assert backtrack(counting, hollow, np.array([0.6, 0.0])) is None
    assert len(steps) <= 16 * GRIDS.steps


def test_what_more_sweeps_change_is_estimated_where_these_end_too_early(monkeypatch):
    model = StepModel(linear.oscillator(0.005), RK4(256))
    (attractor,) = linear.structure(0.005).attractors
    iteration = ValueIteration(model, attractor, GRIDS)
    ceiling = linear.potential(0.005, 1.0, np.array([1.2, 0.0]))
    settled = iteration.up_to(ceiling)
    assert settled.unsettled == 0.0
    levels = {}
    for periods in (44, 80):
        monkeypatch.setattr(value_iteration, "_MOST_PERIODS", periods)
        early = iteration.up_to(ceiling)
        change = 1 - float(np.mean(np.sqrt(settled.values[0])) / np.mean(np.sqrt(early.values[0]))) ** 2
        levels[periods] = change, early.unsettled
    assert all(0 < change < left for change, left in levels.values())
