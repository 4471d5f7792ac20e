"""SGCM: results, errors and bad input."""

import concurrent.futures as futures

import numpy as np
import pytest

import vibrokit as vk
from tests.layers import long
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
    assert result.rates[0].mean_time == pytest.approx(1 / result.rates[0].value, rel=1e-14)


def test_density_has_probability_1(result):
    data = result.data.isel(source=0)
    widths = [np.gradient(data[f"density_{axis}"].values) for axis in ("x", "v")]
    for density in np.exp(data["log_density"].values):
        assert np.nansum(density * np.outer(*widths)) == pytest.approx(1.0, rel=1e-6)


def test_committor_of_a_symmetric_well_is_one_half_on_the_symmetric_saddle(result):
    """By symmetry; in the opposite core it is 1, and its value and that of the mirrored state add up to 1."""
    found = result.committor(0).sel(intensity=6e-3)
    sign = np.sign(result.section.points[0][0, 0])
    assert float(found.interp(x=0.0, v=0.0)) == pytest.approx(0.5, abs=0.01)
    assert float(found.interp(x=-sign * 0.97, v=0.0)) == pytest.approx(1.0, abs=1e-3)
    for x, v in [(0.2, 0.1), (0.1, -0.3), (0.4, 0.2)]:
        both = float(found.interp(x=x, v=v)) + float(found.interp(x=-x, v=-v))
        assert both == pytest.approx(1.0, abs=0.01)
    np.testing.assert_array_equal(found, result.committor("left" if sign < 0 else 0, 1).sel(intensity=6e-3))


def test_mean_exit_time_of_the_saddle_is_half_that_of_the_attractor(result):
    times = result.mean_exit_time(0).sel(intensity=6e-3)
    (rate,) = (rate for rate in result.rates if rate.intensity == 6e-3)
    assert float(times.interp(x=0.0, v=0.0)) == pytest.approx(0.5 * rate.mean_time, rel=0.02)


@pytest.mark.parametrize("pool", [futures.ThreadPoolExecutor, long(futures.ProcessPoolExecutor)])
def test_any_executor_gives_the_same_bits(pool, structure):
    analyzer = vk.SGCM(source=0, intensities=(2e-2,), nodes=(48, 48), steps=8)
    alone = analyzer.run(WELL, structure)
    with pool(3) as executor:
        shared = analyzer.run(WELL, structure, executor=executor)
    for name in ("log_density", "log_rate", "log_committor"):
        np.testing.assert_array_equal(shared.data[name], alone.data[name])


@pytest.mark.long
def test_the_deeper_well_has_the_higher_barrier():
    tilted = double_well(noise=vk.WhiteNoise(intensity=1e-3), excitations=(vk.Constant(0.1),))
    structure = vk.find_structure(tilted, cells=(40, 40), manifolds=False, rng=0)
    found = vk.SGCM(intensities=(1e-3,), steps=8).run(tilted, structure)
    by_side = {np.sign(found.section.points[label][0, 0]): found.barrier(label) for label in (0, 1)}
    assert np.all(by_side[1.0].values > by_side[-1.0].values)
    assert np.all(by_side[-1.0].values > 0)


def test_result_is_saved_and_reopened(result, tmp_path):
    result.save(tmp_path / "sgcm.nc")
    again = vk.load_result(tmp_path / "sgcm.nc")
    assert again.rates == result.rates
    assert again.analyzer == result.analyzer
    assert again.plot().ax.get_xlabel()


@pytest.mark.parametrize(
    ("settings", "reason"),
    [
        ({"intensities": (1e-5,), "nodes": (40, 40), "steps": 8}, "needs"),  # so many nodes
        ({"nodes": (400, 400), "max_memory_gib": 1e-3}, "GiB"),
    ],
)
def test_a_grid_that_cannot_resolve_the_density_or_is_too_large_is_refused(structure, settings, reason):
    found = vk.SGCM(source=0, **settings).run(WELL, structure)
    (failed,) = found.found(vk.Code.SOURCE_FAILED)
    assert reason in failed.values["reason"]
    assert not found.energies


@pytest.mark.slow
def test_intensities_that_cannot_be_resolved_cost_no_others(structure):
    given = (2e-2, 1.5e-2, 1.2e-2, 1e-4)
    found = vk.SGCM(source=0, intensities=given, nodes=(72, 72), steps=8).run(WELL, structure)
    assert [rate.intensity for rate in found.rates] == list(given[:3])
    (failed,) = found.found(vk.Code.INTENSITY_FAILED)
    assert failed.values["intensity"] == 1e-4
    (energy,) = found.energies
    assert energy.lower <= 0.05 <= energy.upper  # 4ζω_n times the barrier of 1/4


@pytest.mark.long
def test_intensities_that_need_too_much_memory_cost_no_others(structure):
    found = vk.SGCM(source=0, intensities=(2e-2, 1.5e-2, 2e-5), steps=8, max_memory_gib=0.005).run(WELL, structure)
    assert [rate.intensity for rate in found.rates] == [2e-2, 1.5e-2]
    (failed,) = found.found(vk.Code.INTENSITY_FAILED)
    assert failed.values["intensity"] == 2e-5


def test_one_intensity_gives_no_energy(structure):
    found = vk.SGCM(source=0, intensities=(2e-2, 1e-4), nodes=(48, 48), steps=8).run(WELL, structure)
    assert len(found.rates) == 1
    assert not found.energies
    (finding,) = found.found(vk.Code.ENERGY_NEEDS_RATES)
    assert (finding.source, finding.target, finding.values["known"]) == (0, 1, 1)


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
        ({"nodes": (1, 1)}, "(1, 1)"), ({"nodes": 100}, "32 or more"), ({"steps": 7}, "7"), ({"steps": 0}, "0"),
        ({"intensities": "weak"}, "w"), ({"intensities": (1e-3, 0.0)}, "0"), ({"intensities": ()}, "()"),
        ({"intensities": (float("nan"),)}, "nan"), ({"max_memory_gib": -1}, "-1"), ({"accuracy": 0.0}, "0"),
    ],
)  # fmt: skip
def test_bad_settings(settings, shown):
    with pytest.raises(vk.errors.StructureError, match="SGCM") as refused:
        vk.SGCM(**settings)
    assert shown in str(refused.value)


def test_intensities_of_an_array_are_those_of_a_tuple():
    assert vk.SGCM(intensities=np.array([1e-3, 2e-3])) == vk.SGCM(intensities=(2e-3, 1e-3))


@pytest.mark.long
def test_noise_is_weak_against_the_intensities_of_the_method_not_of_the_scene(structure):
    loud = WELL.replace({"noise.intensity": 0.5})
    quiet = vk.SGCM(source=0, intensities=(8e-3, 6e-3), nodes=(90, 90), steps=8).run(loud, structure)
    assert quiet.energies
    assert not quiet.found(vk.Code.NOISE_NOT_WEAK)


@pytest.mark.slow
def test_scenes_that_are_refused():
    coloured = WELL.replace(noise=Coloured(intensity=1e-3, rate=2.0))
    one_attractor = scene(damping_ratio=0.2, noise=vk.WhiteNoise(intensity=1e-3))
    for osc, error, words in (
        (coloured, vk.errors.SceneError, "3 dimensions"),
        (one_attractor, vk.errors.StructureError, "only one attractor"),
    ):
        with pytest.raises(error, match=words):
            vk.SGCM(nodes=(40, 40)).run(osc, vk.find_structure(osc, cells=(20, 20), manifolds=False, rng=0))


class LeaveStrip(vk.LeaveRegion):
    """|x| beyond half a width."""

    half: float = 0.5

    def bounds(self, osc):
        """A strip that is not bounded in v."""
        return np.array([[-self.half, self.half], [-np.inf, np.inf]])


def left_by_position(noise, **exit_):
    osc = scene(damping_ratio=0.2, noise=noise)
    structure = vk.find_structure(osc, region=((-1, 1), (-1, 1)), cells=(20, 20), manifolds=False)
    return vk.SGCM(intensities=(1e-2,), exit=LeaveStrip(**exit_), nodes=(64, 64), steps=8).run(osc, structure)


@pytest.mark.slow
def test_an_equilibrium_alone_is_left_by_position():
    (rate,) = left_by_position(vk.WhiteNoise(intensity=1e-2)).rates
    assert rate.event == "contact"
    assert 0 < rate.value < 1
    beyond_the_density = left_by_position(vk.WhiteNoise(intensity=1e-2), half=50.0)
    assert not beyond_the_density.rates
    assert not beyond_the_density.energies
    (failed,) = left_by_position(vk.StateDependentNoise(1e-2, "v")).found(vk.Code.SOURCE_FAILED)
    assert "noise is 0" in failed.values["reason"]
