"""Steps of a linear scene, where cost, centre and uphill start are known exactly."""

import numpy as np
import pytest

from tests.analyzers.graph import linear
from vibrokit.analyzers.graph.grids import Grids
from vibrokit.analyzers.graph.step_model import StepModel
from vibrokit.kernels.located import Order8

STEP = 0.7
GRIDS = Grids(np.array([[[-2.0, 2.0], [-3.0, 3.0]]]), (41, 31), STEP, 1)
SCENES = [(0.05, 1.0), (0.4, 1.7), (1.5, 1.0)]
ENDS = np.array([[0.3, -0.2], [-1.1, 1.4], [0.0, 0.0]])
STARTS = np.array([[0.1, 0.5], [-0.7, 1.9], [1.0, -1.0]])


def model(damping, natural):
    return StepModel(linear.oscillator(damping, natural), Order8(tolerance=1e-12))


@pytest.mark.parametrize("scene", SCENES)
def test_images_derivatives_and_covariances(scene):
    slope, covariance = linear.flow(*scene, STEP)
    found = model(*scene).linear(ENDS, 0.0, STEP)
    np.testing.assert_allclose(found.images, ENDS @ slope.T, atol=1e-9)
    np.testing.assert_allclose(model(*scene).images(ENDS, 0.0, STEP), ENDS @ slope.T, atol=1e-9)
    np.testing.assert_allclose(found.derivatives, np.tile(slope, (3, 1, 1)), atol=1e-9)
    np.testing.assert_allclose(found.covariances, np.tile(covariance, (3, 1, 1)), atol=1e-9)


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("duration", [None, 0.2])
@pytest.mark.parametrize("inside", [True, False])
def test_a_step_costs_half_the_squared_miss_in_units_of_the_noise(scene, duration, inside):
    """½ eᵀ C⁻¹ e with e = y − M x, whether b lies on the grid or the step is linearized from where it starts uphill."""
    time = duration or STEP
    slope, covariance = linear.flow(*scene, time)
    grids = GRIDS if inside else Grids(GRIDS.boxes * 1e-6, GRIDS.shape, STEP, 1)
    costs = model(*scene).into(ENDS, grids, 0, duration)
    miss = ENDS - STARTS @ slope.T
    exact = 0.5 * np.einsum("ni,ij,nj->n", miss, np.linalg.inv(covariance), miss)
    assert costs.cost(grids.index(0, STARTS)) == pytest.approx(exact, rel=1e-7)
    np.testing.assert_allclose(grids.states(0, costs.centres), ENDS @ np.linalg.inv(slope).T, atol=1e-8)


def test_one_start_for_all_states():
    costs = model(0.4, 1.7).into(ENDS, GRIDS, 0)
    together = costs.cost(GRIDS.index(0, STARTS[0]))
    np.testing.assert_allclose(together, costs.cost(GRIDS.index(0, np.tile(STARTS[0], (3, 1)))))


def test_uphill_is_the_image_of_the_mirrored_state_mirrored_and_kept_in_the_box():
    mirror = np.diag([1.0, -1.0])
    slope, _ = linear.flow(0.4, 1.0, STEP)
    exact = ENDS @ mirror @ slope.T @ mirror
    costs = model(0.4, 1.0).into(ENDS, GRIDS, 0)
    np.testing.assert_allclose(GRIDS.states(0, costs.uphill), exact, atol=1e-9)
    small = Grids(GRIDS.boxes * 0.1, GRIDS.shape, STEP, 1)
    clipped = np.clip(exact, small.boxes[0, :, 0], small.boxes[0, :, 1])
    np.testing.assert_allclose(small.states(0, model(0.4, 1.0).into(ENDS, small, 0).uphill), clipped, atol=1e-9)


def test_states_that_run_out_of_range_cost_nothing_known():
    costs = model(0.4, 1.0).into(np.array([[np.nan, 0.0], [0.3, -0.2]]), GRIDS, 0)
    assert np.isnan(costs.centres[0]).all()
    assert np.isfinite(costs.centres[1]).all()
