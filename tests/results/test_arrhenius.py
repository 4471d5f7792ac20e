"""The fit of the Arrhenius law, and how far its slope is from the activation energy."""

import numpy as np
import pytest

from vibrokit.results.arrhenius import ArrheniusFit
from vibrokit.results.exit_rate import ExitRate

LADDERS = [(0.03, 0.024, 0.02), (0.05, 0.03, 0.02), (0.05, 0.03, 0.02, 0.0125, 0.01)]


def fit_of(intensities, power, error=0.02):
    """A fit to τ = 20 D^−power exp(0.2/D)."""
    rates = [
        ExitRate(0, 1, d, -(np.log(20.0) - power * np.log(d) + 0.2 / d), error, "commitment", "direct")
        for d in intensities
    ]
    return ArrheniusFit.of(rates)


@pytest.mark.parametrize("intensities", LADDERS)
@pytest.mark.parametrize("power", [-1.0, -0.5, 0.0, 0.5, 1.0])
def test_the_interval_contains_the_energy_if_the_prefactor_is_a_power_of_the_noise(intensities, power):
    low, high = fit_of(intensities, power).interval
    assert low <= 0.2 <= high


def test_an_exact_law_has_only_the_error_of_an_unknown_prefactor():
    fit = fit_of((0.03, 0.024, 0.02), 0.0, error=1e-9)
    assert fit.slope == pytest.approx(0.2, rel=1e-9)
    assert 0.02 < fit.systematic < 0.03


def test_a_slope_that_drifts_has_the_error_of_the_power_that_it_shows():
    fit = fit_of((0.05, 0.03, 0.02, 0.0125, 0.01), 4.0)
    assert fit.drifts
    assert fit.systematic == pytest.approx(abs(fit.slope - 0.2), rel=0.05)


def test_two_intensities_do_not_show_the_power():
    assert fit_of((0.05, 0.0125), 0.0).interval == (-np.inf, np.inf)


def test_the_interval_holds_the_energy_as_often_as_it_says_if_powers_are_as_assumed():
    """Errors of 15 % hide the power, those of 1 % show it; 300 cases each have a standard error of 1.3 %."""
    rng, intensities = np.random.default_rng(1), np.array([0.05, 0.2 / 7, 0.2 / 12])
    for error in (0.15, 0.05, 0.01):
        held = 0
        for _ in range(300):
            log_times = 0.2 / intensities - rng.standard_normal() * np.log(intensities)
            noisy = log_times + error * rng.standard_normal(3)
            rates = [ExitRate(0, 1, d, -y, error, "", "") for d, y in zip(intensities, noisy, strict=True)]
            low, high = ArrheniusFit.of(rates).interval
            held += low <= 0.2 <= high
        assert held >= 0.91 * 300
