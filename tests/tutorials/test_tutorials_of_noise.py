"""The tutorials on least action, densities and an assessment run as scripts, and what they find agrees with formulas.

They are long, since the manual runs them, too, and others show the same: tests/physics/test_least_action.py and
test_densities.py.
"""

import numpy as np
import pytest

from tests.tutorials.pictures import assert_pictures
from vibrokit.results.codes import Code

pytestmark = pytest.mark.long

OMEGA_N, ZETA, OMEGA, F0, F1 = 1.0, 0.01, 0.57, 0.18, 0.2

# -- 04: least action -------------------------------------------------------------------------------------------------

CERTIFIED_CLEAR = 7.9052e-5  # by direct minimisation, tests/physics/reference_action.py: 7.905215e-5 ± 1e-11


@pytest.fixture(scope="module")
def least(run):
    return run("04_least_action")


def test_the_climb_out_of_a_well(least):
    """ΔU is 4ζω_n times the barrier of x⁴/4 − x²/2, the path its relaxation run backwards."""
    assert least.energy.value == pytest.approx(4 * 0.05 * 0.25, rel=1e-6)
    assert least.misfit < 1e-6 * least.largest
    heights = least.path.q[:, 0] ** 4 / 4 - least.path.q[:, 0] ** 2 / 2 + least.path.q[:, 1] ** 2 / 2
    climbed = 4 * 0.05 * (heights + 0.25)
    assert least.path.action == pytest.approx(climbed, abs=1e-6 * least.energy.value)


def test_the_clear_state_is_left_at_the_certified_price(least):
    assert least.clear.value == pytest.approx(CERTIFIED_CLEAR, rel=1e-4)
    assert least.clear.lower <= least.clear.value <= least.clear.upper
    assert [finding.source for finding in least.result.found(Code.AGREEMENT)][:1] == [0]


def test_both_paths_solve_their_equations_and_end_on_the_saddle(least):
    for energy in least.result.energies:
        assert energy.certificate.residual < 1e-9
        assert energy.certificate.error < 1e-5 * energy.value
        assert energy.path.q[-1] == pytest.approx(least.saddle.points[0], abs=1e-3)
        assert energy.path.action[-1] == pytest.approx(energy.value, rel=1e-5)
    assert {(energy.source, energy.target) for energy in least.result.energies} == {(0, 1), (1, 0)}


def test_shots_are_dearer_than_the_certified_path(least):
    whole, ring = (found.energies[0] for found in (least.shots, least.ring))
    assert CERTIFIED_CLEAR < whole.value < ring.value
    assert whole.value < 1.01 * CERTIFIED_CLEAR


def test_the_price_of_a_touch(least):
    swing = F0 / np.sqrt((OMEGA_N**2 - OMEGA**2) ** 2 + (2 * ZETA * OMEGA_N * OMEGA) ** 2)
    exact = 2 * ZETA * OMEGA_N**3 * (0.5 - F1 / OMEGA_N**2 - swing) ** 2
    assert least.touch.value == pytest.approx(exact, rel=1e-8)
    assert least.by_formula == pytest.approx(exact, rel=1e-12)


def test_what_is_left_first_and_what_lasts(least):
    assert least.transitions.most_stable == 1
    assert least.transitions.cycle_hierarchy[0].source == 0


def test_pictures_of_the_least_action(least):
    assert_pictures(least, 4)


# -- 05: densities ----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def densities(run):
    return run("05_densities")


def test_density_of_the_well_is_the_one_of_boltzmann_to_a_depth_of_50(densities):
    assert densities.stationary.occupancies.values == pytest.approx(0.5, rel=1e-6)
    assert densities.depth == pytest.approx(50.0)
    assert max(densities.misfits) < 0.25


def test_rates_of_the_well_are_those_of_kramers(densities):
    """The formula has an error of 2 % at these intensities (tests/physics/test_densities.py)."""
    for rate in densities.left_rates:
        expected = (np.sqrt(1.04) - 0.2) / (np.sqrt(2) * np.pi) * np.exp(-0.2 / rate.intensity)
        assert rate.value == pytest.approx(expected, rel=0.08)
        assert rate.lower <= expected <= rate.upper


def test_both_wells_are_equally_likely_from_the_saddle(densities):
    assert densities.at_saddle == pytest.approx(0.5, abs=0.005)
    assert densities.time_ratios == pytest.approx(0.5, abs=0.005)


def test_limit_of_weak_noise_is_the_barrier(densities):
    assert densities.limit.lower <= 0.2 <= densities.limit.upper
    assert densities.limit.value == pytest.approx(0.2, rel=0.01)


def test_transients_are_those_of_simulated_trajectories(densities):
    assert densities.history.mass == pytest.approx(1.0, abs=1e-3)
    assert max(densities.differences) < 0.013  # 1.86 over the root of 20 000: exceeded by chance once in 500


def test_pictures_of_the_densities(densities):
    assert_pictures(densities, 4)


# -- 08: from a spectrum to a verdict ---------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def lever(run):
    return run("08_from_spectrum_to_verdict")


def test_record_gives_the_true_inputs(lever):
    """The amplitude of a wave in white noise has the variance 2σ²/n from n samples, σ² = D times the sampling rate."""
    true_intensity = 2e-6 * 9.80665**2 / 2
    assert abs(lever.amplitude - 4.5 / 0.42) < 4 * np.sqrt(2 * true_intensity / 32)
    assert abs(lever.D - true_intensity) < 4 * lever.D_error
    assert lever.D_error / lever.D == pytest.approx(np.sqrt(1 / (0.3 * 1024 * 32)), rel=0.1)
    assert lever.estimate.misfit == pytest.approx(1.0, abs=0.2)


def test_scene_of_the_drawing(lever):
    assert lever.osc.own_frequency == pytest.approx(np.sqrt(31e3 / 0.42), rel=1e-12)
    assert lever.osc.parameters["barriers.0.law.stiffness"] == pytest.approx(1.5e6 / 0.42, rel=1e-12)
    assert lever.osc.parameters["noise.intensity"] == lever.D


def test_verdict_on_the_lever(lever):
    """An exit touches a stop first, at the price of the linear oscillator."""
    rate, drive = np.sqrt(31e3 / 0.42), 2 * np.pi * 54
    swing = lever.amplitude / abs(rate**2 - drive**2 + 0.03j * rate * drive)
    assert lever.energy.value > 2 * 0.015 * rate**3 * (3e-4 - swing) ** 2
    time = lever.a.mean_time("clear")
    assert 0.1 < time.value * np.exp(-lever.ratio) * 54 < 100  # the prefactor in periods
    assert lever.a.probability_of_leaving("clear", "1 h").value == pytest.approx(-np.expm1(-3600 / time.value))
    assert [verdict.code.value for verdict in lever.a.reconciliation.verdicts] == ["agree"]


def test_pictures_of_the_lever(lever):
    assert_pictures(lever, 2)
