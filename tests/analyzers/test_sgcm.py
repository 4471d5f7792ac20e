"""SGCM: results, errors and bad input."""

import numpy as np
import pytest

import vibrokit as vk
from tests.scenes import Coloured, double_well, scene

WELL = double_well(noise=vk.WhiteNoise(intensity=6e-3))


@pytest.fixture(scope="module")
def structure():
    return vk.find_structure(WELL, cells=(40, 40), manifolds=False, rng=0)


@pytest.fixture(scope="module")
def result(structure):
    return vk.SGCM(source=0, intensities=(8e-3, 6e-3), nodes=(90, 90), steps=16).run(WELL, structure)


def test_rates_at_each_intensity(result):
    assert [rate.intensity for rate in result.rates] == [8e-3, 6e-3]
    assert {(rate.source, rate.target, rate.event) for rate in result.rates} == {(0, 1, "commitment")}
    assert all(0 < rate.lower < rate.value < rate.upper for rate in result.rates)
    assert result.rates[1].value < result.rates[0].value
    assert result.rates[0].mean_time == 1 / result.rates[0].value


def test_density_has_probability_1(result):
    data = result.data.isel(source=0)
    widths = [np.gradient(data[f"density_{axis}"].values) for axis in ("x", "v")]
    for density in np.exp(data["log_density"].values):
        assert np.nansum(density * np.outer(*widths)) == pytest.approx(1.0, rel=1e-6)


def test_result_is_saved_and_reopened(result, tmp_path):
    result.save(tmp_path / "sgcm.nc")
    again = vk.load_result(tmp_path / "sgcm.nc")
    assert again.rates == result.rates
    assert again.analyzer == result.analyzer
    assert again.plot().ax.get_xlabel()


def test_same_bits_again(result, structure):
    again = vk.SGCM(source=0, intensities=(8e-3, 6e-3), nodes=(90, 90), steps=16).run(WELL, structure)
    np.testing.assert_array_equal(again.data["log_density"], result.data["log_density"])


def test_a_grid_that_cannot_resolve_the_density_is_refused_with_the_nodes_it_needs(structure):
    found = vk.SGCM(source=0, intensities=(1e-5,), nodes=(40, 40), steps=8).run(WELL, structure)
    (failed,) = found.found(vk.Code.SOURCE_FAILED)
    assert "needs" in failed.values["reason"]
    assert not found.energies


def test_a_rate_that_depends_on_the_nodes_is_uncertain(structure):
    found = vk.SGCM(source=0, intensities=(4e-3,), nodes=(64, 64), steps=8).run(WELL, structure)
    (rate,) = found.rates
    assert found.found(vk.Code.RATE_UNCERTAIN)
    assert rate.upper > 1.1 * rate.value


def test_time_limit_keeps_what_was_solved(structure):
    limited = vk.SGCM(nodes=(90, 90), steps=16).run(WELL, structure, time_limit=1e-3)
    assert not limited.complete
    assert vk.Code.STOPPED in {finding.code for finding in limited.findings}


@pytest.mark.parametrize(
    ("settings", "shown"),
    [
        ({"nodes": (1, 1)}, "(1, 1)"),
        ({"steps": 7}, "7"),
        ({"steps": 0}, "0"),
        ({"intensities": (1e-3, 0.0)}, "0"),
        ({"intensities": ()}, "()"),
        ({"intensities": (float("nan"),)}, "nan"),
        ({"max_memory_gib": -1}, "-1"),
    ],
)
def test_bad_settings(settings, shown):
    with pytest.raises(vk.errors.StructureError, match="SGCM") as refused:
        vk.SGCM(**settings)
    assert shown in str(refused.value)


def test_too_little_memory(structure):
    found = vk.SGCM(source=0, nodes=(400, 400), max_memory_gib=1e-3).run(WELL, structure)
    (failed,) = [finding for finding in found.findings if finding.code is vk.Code.SOURCE_FAILED]
    assert "GiB" in failed.values["reason"]


def test_noise_with_states_of_its_own(structure):
    coloured = WELL.replace(noise=Coloured(intensity=1e-3, rate=2.0))
    with pytest.raises(vk.errors.SceneError, match="3 dimensions"):
        vk.SGCM().run(coloured, vk.find_structure(coloured, cells=(20, 20), manifolds=False, rng=0))


def test_one_attractor_has_nowhere_to_go():
    osc = scene(damping_ratio=0.2, noise=vk.WhiteNoise(intensity=1e-3))
    with pytest.raises(vk.errors.StructureError, match="only one attractor"):
        vk.SGCM(nodes=(40, 40)).run(osc, vk.find_structure(osc, cells=(20, 20), rng=0))
