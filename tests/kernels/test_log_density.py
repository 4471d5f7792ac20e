"""Steps of ln ρ on a grid, where the answer is known in closed form."""

import numpy as np
import pytest

from vibrokit.kernels.log_density import EMPTY, ROUGH, SMOOTH, SUMMED, WIDEST, parts_of, step_rows

NODES = np.stack(np.meshgrid(np.arange(40.0), np.arange(50.0), indexing="ij"), axis=-1)
NO_WEIGHT = NOTHING = np.empty((0, 0))
FLOOR = -1e6
EVERYWHERE_ROUGH = np.full(NODES.shape[:2], ROUGH, dtype=np.uint8)


def gaussian(centre, variances):
    return -0.5 * np.sum((NODES - centre) ** 2 / variances, axis=-1)


def stepped(phi, feet=NODES, spread=0.0, parts=1, rough=EVERYWHERE_ROUGH, share=NOTHING, value=-np.inf):
    """φ, its marks and what an exit has taken up after a step of the flow and parts of diffusion."""
    out, marks = np.empty_like(phi), np.empty(phi.shape, dtype=np.uint8)
    spreads, growth, taken = np.full_like(phi, spread), np.zeros_like(phi), np.empty(len(phi))
    given = (phi, rough, feet, growth, share, value, NO_WEIGHT, spreads, parts, FLOOR)
    step_rows(*given, out, marks, taken, 0, len(phi))
    return out, marks, taken


@pytest.mark.parametrize(("depth", "spread", "parts"), [(1.0, 0.3, 1), (1.0, WIDEST, 5), (1e3, 0.02, 1)])
def test_diffusion_of_a_gaussian_widens_it_by_the_variance(depth, spread, parts):
    variances = np.array([30.0, 40.0]) / depth
    found, *_ = stepped(gaussian([20.0, 25.0], variances), spread=spread, parts=parts)
    widened = variances + np.array([0.0, parts * spread**2])
    expected = gaussian([20.0, 25.0], widened) + 0.5 * np.log(variances[1] / widened[1])
    margin = 10 + 4 * parts // 3
    assert expected[:, margin:-margin].min() < -5 * depth
    np.testing.assert_allclose(found[:, margin:-margin], expected[:, margin:-margin], rtol=1e-9, atol=1e-11)


def test_diffusion_keeps_the_probability_of_a_step():
    phi = np.where(NODES[..., 1] < 25, 0.0, FLOOR)
    found, *_ = stepped(phi, spread=0.9 * WIDEST)
    assert np.exp(found[:, 8:-8]).sum() == pytest.approx(np.exp(phi[:, 8:-8]).sum(), rel=1e-3)
    assert found.max() <= 1e-12


@pytest.mark.parametrize("spread", [1.2, 3.0])
def test_wide_diffusion_is_a_sum_that_is_exact_at_any_depth(spread):
    variances = np.array([0.3, 9.0])
    found, *_ = stepped(gaussian([20.0, 25.0], variances), spread=spread, parts=parts_of(spread))
    widened = variances + np.array([0.0, spread**2])
    expected = gaussian([20.0, 25.0], widened) + 0.5 * np.log(variances[1] / widened[1])
    assert parts_of(spread) == 0
    assert expected.min() < -600
    np.testing.assert_allclose(found[:, 15:-15], expected[:, 15:-15], rtol=1e-6, atol=1e-6)


def test_parts_are_narrow_enough_or_the_diffusion_is_summed():
    assert [parts_of(WIDEST), parts_of(1.01 * WIDEST), parts_of(SUMMED), parts_of(1.01 * SUMMED)] == [1, 2, 4, 0]


def test_nothing_is_computed_where_there_is_nothing():
    phi = np.full(NODES.shape[:2], FLOOR)
    phi[20, 25] = 0.0
    found, marks, _ = stepped(phi, spread=WIDEST)
    others = np.arange(len(phi)) != 20
    assert np.all(found[others] == FLOOR)
    assert np.all(marks[others] == EMPTY)
    assert np.all(marks[20, 22:28] == ROUGH)
    assert np.exp(found[20]).sum() == pytest.approx(1.0, rel=1e-7)


@pytest.mark.parametrize("smooth", [True, False])
def test_transport_of_a_quadratic_form_is_exact(smooth):
    phi = gaussian([20.0, 25.0], np.array([0.03, 0.04]))
    feet = NODES + np.array([0.3, -0.4])
    _, marks, _ = stepped(phi)
    assert np.all(marks[:, 3:-3] == SMOOTH)
    found, *_ = stepped(phi, feet, rough=marks if smooth else EVERYWHERE_ROUGH)
    inner = (slice(3, -3), slice(3, -3))
    np.testing.assert_allclose(found[inner], gaussian([19.7, 25.4], np.array([0.03, 0.04]))[inner], rtol=1e-11)


def test_transport_of_a_smooth_function_has_order_six():
    errors = []
    for length in (20.0, 40.0):
        phi = np.sin(NODES[..., 0] / length * 2 * np.pi) * np.cos(NODES[..., 1] / length * 2 * np.pi)
        _, marks, _ = stepped(phi)
        shift = np.array([0.4, 0.3])
        found, *_ = stepped(phi, NODES + shift, rough=marks)
        angles = (NODES + shift) / length * 2 * np.pi
        exact = np.sin(angles[..., 0]) * np.cos(angles[..., 1])
        errors.append(np.abs(found - exact)[5:-5, 5:-5].max())
    assert np.log2(errors[0] / errors[1]) > 5.5


def test_transport_across_a_jump_interpolates_the_density():
    phi = np.where(NODES[..., 1] < 25, 0.0, FLOOR)
    found, *_ = stepped(phi, NODES + np.array([0.0, 0.25]))
    assert np.exp(found[10, 22:27]) == pytest.approx([1.0, 1.0, 0.75, 0.0, 0.0], abs=1e-12)


@pytest.mark.parametrize("foot", [np.nan, -0.1, 1e9])
def test_motion_from_outside_the_grid_brings_the_floor(foot):
    feet = NODES.copy()
    feet[5, 5] = foot
    assert stepped(np.zeros(NODES.shape[:2]), feet)[0][5, 5] == FLOOR


def test_an_exit_takes_up_its_share_before_the_diffusion():
    phi, share = gaussian([20.0, 25.0], np.array([30.0, 40.0])), np.zeros(NODES.shape[:2])
    share[:, 30:], share[:, 29] = 1 - 1e-9, 0.25
    found, _, taken = stepped(phi, share=share)
    np.testing.assert_allclose(np.exp(taken), (np.exp(phi) * share).sum(axis=1), rtol=1e-12)
    np.testing.assert_allclose(found, phi + np.log1p(-share), rtol=1e-12, atol=1e-12)
    spread_out, *_ = stepped(phi, share=share, spread=0.35)
    assert np.all(spread_out[:, 30] > found[:, 30] + 5)


def test_an_expected_value_at_the_exit_is_that_of_the_exit():
    values, share = np.full(NODES.shape[:2], -50.0), np.zeros(NODES.shape[:2])
    share[:, 30:], share[:, 29] = 1 - 1e-9, 0.25
    found, *_ = stepped(values, share=share, value=0.0)
    np.testing.assert_allclose(np.exp(found), share + (1 - share) * np.exp(-50.0), rtol=1e-12)
