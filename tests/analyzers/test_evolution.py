"""Densities in time: closed forms, records and bad input."""

import concurrent.futures as futures

import numpy as np
import pytest
from scipy.linalg import expm

import vibrokit as vk
from tests.scenes import Coloured, scene

REGION = ((-1.0, 1.0), (-1.0, 1.0))
LINEAR = scene(damping_ratio=0.2, noise=vk.WhiteNoise(intensity=0.01))
START = (0.4, -0.2)


@pytest.fixture(scope="module")
def history():
    return vk.evolve_density(LINEAR, REGION, (0.25, 1, 3), start=START, nodes=(100, 100), steps=16)


def normal_moments(time, variances):
    """Mean and covariance of the linear oscillator, by matrix exponentials (Van Loan 1978)."""
    drift = np.array([[0.0, 1.0], [-1.0, -0.4]])
    block = np.block([[-drift, np.diag([0.0, 0.01])], [np.zeros((2, 2)), drift.T]])
    power = expm(block * time)
    transition = power[2:, 2:].T
    return transition @ START, transition @ np.diag(variances) @ transition.T + transition @ power[:2, 2:]


def largest_errors(history):
    """Of ln ρ down to 10 below the maximum, at each time."""
    spacing = np.array([np.diff(history.x).mean(), np.diff(history.v).mean()])
    nodes = np.stack(np.meshgrid(history.x, history.v, indexing="ij"), axis=-1)
    errors = []
    for time, log_density in zip(history.times, history.log_density, strict=True):
        mean, covariance = normal_moments(time, (1.5 * spacing) ** 2)
        offsets = nodes - mean
        exponents = -0.5 * np.einsum("xvi,ij,xvj->xv", offsets, np.linalg.inv(covariance), offsets)
        expected = exponents - 0.5 * np.log(np.linalg.det(2 * np.pi * covariance))
        errors.append(np.abs(log_density - expected)[exponents > -10].max())
    return np.array(errors)


@pytest.mark.slow
def test_a_normal_distribution_stays_one_with_the_exact_moments_to_second_order_in_the_step():
    fine = {"start": START, "nodes": (150, 150)}
    errors = [largest_errors(vk.evolve_density(LINEAR, REGION, (0.25, 1), steps=n, **fine)) for n in (16, 32, 64, 128)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(orders > 1.8)


def test_probability_is_kept(history):
    np.testing.assert_allclose(history.times, np.array([0.25, 1, 3]) * LINEAR.section_interval)
    np.testing.assert_allclose(history.mass, 1.0, rtol=1e-12)
    np.testing.assert_allclose(history.marginal("x").integrate("x"), history.mass, rtol=1e-2)
    assert not history.findings


@pytest.mark.parametrize("pool", [futures.ThreadPoolExecutor, futures.ProcessPoolExecutor])
def test_any_executor_gives_the_same_bits(pool):
    given = {"intervals": (1,), "nodes": (40, 40), "steps": 8}
    alone = vk.evolve_density(LINEAR, REGION, **given)
    with pool(3) as executor:
        shared = vk.evolve_density(LINEAR, REGION, **given, executor=executor)
    np.testing.assert_array_equal(shared.log_density, alone.log_density)
    assert np.isfinite(alone.log_density).any()


@pytest.mark.long
def test_any_time_and_any_phase():
    # a start at a phase is the start at the section of the same scene with its forcing moved
    forced = {"damping_ratio": 0.2, "noise": vk.WhiteNoise(intensity=0.01)}
    drive, later = (vk.Harmonic(amplitude=0.1, frequency=1.0, phase=angle) for angle in (0.0, 0.7))
    first, second = (scene(excitations=(one,), **forced) for one in (drive, later))
    given = {"intervals": (0.4, 1.1), "start": START, "nodes": (150, 150), "steps": 64}
    moved = vk.evolve_density(first, REGION, phase=0.7 / (2 * np.pi), **given)
    direct = vk.evolve_density(second, REGION, **given)
    np.testing.assert_allclose(moved.times, np.array([0.4, 1.1]) * first.section_interval)
    both = (moved.log_density > -8) & (direct.log_density > -8)
    np.testing.assert_allclose(moved.log_density[both], direct.log_density[both], atol=2e-3)


def test_a_start_on_an_attractor(history):
    attractor = vk.find_structure(LINEAR, region=REGION, cells=(20, 20), manifolds=False).attractors[0]
    begun = vk.evolve_density(LINEAR, REGION, (1,), start=attractor, nodes=(100, 100), steps=16)
    same = vk.evolve_density(LINEAR, REGION, (1,), start=attractor.points[0], nodes=(100, 100), steps=16)
    np.testing.assert_array_equal(begun.log_density, same.log_density)


def test_saved_and_reopened(history, tmp_path):
    history.save(tmp_path / "history.nc")
    again = vk.load_result(tmp_path / "history.nc")
    np.testing.assert_array_equal(again.log_density, history.log_density)
    artists = again.plot(axis="v")
    assert len(artists.lines) == 3
    assert "velocity" in artists.ax.get_xlabel()


def test_what_leaves_the_region_is_reported():
    narrow = vk.evolve_density(LINEAR, ((-0.2, 0.2), (-0.2, 0.2)), (1,), nodes=(40, 40), steps=16)
    (finding,) = narrow.found(vk.Code.MASS_NOT_KEPT)
    assert finding.values["mass"] == narrow.mass[0] < 0.99


def test_a_density_that_is_too_narrow_for_the_nodes_is_reported():
    weak = LINEAR.replace({"noise.intensity": 1e-5})
    found = vk.evolve_density(weak, REGION, (5,), start=((-0.3, 0.3), (-0.3, 0.3)), nodes=(40, 40), steps=16)
    (finding,) = found.found(vk.Code.DENSITY_TRUNCATED)
    assert abs(finding.values["change"]) > 0.01
    np.testing.assert_allclose(found.mass, 1.0, rtol=1e-9)


def test_what_was_reached_before_a_stop_is_kept():
    def interrupt(update):
        if update.stage == "density" and update.done >= 2 and not update.finished:
            raise KeyboardInterrupt

    for stop, reached in (({"progress": interrupt}, 1), ({"time_limit": 1e-4}, 0)):
        stopped = vk.evolve_density(LINEAR, REGION, (1, 2000), nodes=(40, 40), steps=8, **stop)
        assert not stopped.complete
        assert len(stopped.times) == reached
        assert stopped.found(vk.Code.STOPPED)


@pytest.mark.parametrize(
    ("given", "shown"),
    [
        ({"intervals": ()}, "()"), ({"intervals": (2, 1)}, "(2, 1)"), ({"intervals": (0.0,)}, "0"),
        ({"intervals": (float("nan"),)}, "nan"), ({"start": (3.0, 0.0)}, "3"), ({"start": (0.1, 0.2, 0.3)}, "0.3"),
        ({"start": "a"}, "'a'"), ({"start": ((0.0, 1e-4), (0.0, 1e-4)), "nodes": (50, 50)}, "contains no node"),
        ({"nodes": (1, 1)}, "(1, 1)"), ({"steps": 0}, "0"), ({"steps": 7}, "7"), ({"phase": 1.0}, "1"),
    ],
)  # fmt: skip
def test_bad_arguments(given, shown):
    with pytest.raises(vk.errors.StructureError, match="evolve_density") as refused:
        vk.evolve_density(LINEAR, REGION, **given)
    assert shown in str(refused.value)


def test_scenes_that_have_no_density_of_two_dimensions():
    with pytest.raises(vk.errors.SceneError, match="no noise"):
        vk.evolve_density(LINEAR.replace(noise=None), REGION)
    with pytest.raises(vk.errors.SceneError, match="3 dimensions"):
        vk.evolve_density(LINEAR.replace(noise=Coloured(intensity=1e-3, rate=2.0)), REGION)
