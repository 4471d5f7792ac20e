"""The limit D → 0 of D ln τ."""

import numpy as np
import pytest

from vibrokit.analyzers.sgcm.at_intensity import limit_of

ENERGY = 5.0
LADDERS = [(1.5, 1.2, 1.0), (1.0, 0.7), (2.5, 0.8, 0.4, 0.25), (1.2, 0.3)]


def log_times(intensities, power, bend):
    """ln of D^−power exp(ΔU/D) with a correction of first order in D/ΔU, and a prefactor of 300."""
    d = np.array(intensities)
    return ENERGY / d - power * np.log(d) + bend * d / ENERGY + np.log(300.0)


@pytest.mark.parametrize("intensities", LADDERS)
def test_a_straight_line_is_extrapolated_exactly(intensities):
    value, _ = limit_of(intensities, log_times(intensities, 0.0, 0.0), [0.0] * len(intensities))
    assert value == pytest.approx(ENERGY, rel=1e-12)


@pytest.mark.parametrize("intensities", LADDERS)
@pytest.mark.parametrize("power", [-1.0, -0.5, 0.0, 0.5, 1.0])
def test_the_error_contains_the_limit_of_a_prefactor_with_a_power_of_the_noise(intensities, power):
    value, error = limit_of(intensities, log_times(intensities, power, 0.0), [0.0] * len(intensities))
    assert abs(value - ENERGY) <= error * (1 + 1e-9)
    assert error <= 1.5 * intensities[-2] or len(intensities) == 2


@pytest.mark.parametrize("intensities", LADDERS)
@pytest.mark.parametrize("bend", [1.0, -1.0])
def test_the_error_contains_the_limit_of_the_next_order_of_kramers_formula(intensities, bend):
    value, error = limit_of(intensities, log_times(intensities, 0.0, bend), [0.0] * len(intensities))
    assert abs(value - ENERGY) <= error * (1 + 1e-9)


def test_two_intensities_do_not_show_how_the_prefactor_depends_on_the_noise():
    assert limit_of((1.2, 0.3), log_times((1.2, 0.3), 0.0, 0.0), [0.0, 0.0])[1] == np.inf


@pytest.mark.parametrize("power", [2.0, -3.0])
def test_three_intensities_show_a_larger_power(power):
    intensities = (1.5, 1.2, 1.0)
    value, error = limit_of(intensities, log_times(intensities, power, 0.0), [0.0] * 3)
    assert abs(value - ENERGY) <= error * (1 + 1e-9)
    assert error > intensities[-2]


def test_errors_of_rates_are_those_of_the_straight_line():
    given = [3.0, 2.0, 1.0], log_times([3.0, 2.0, 1.0], 0.0, 0.0)
    _, exact = limit_of(*given, [0.0] * 3)
    _, error = limit_of(*given, [0.0, 0.03, 0.01])
    assert error - exact == pytest.approx(np.hypot(2 * 0.01 * 1, 1 * 0.03 * 2))


def test_what_changes_all_rates_alike_changes_the_product_at_the_least_intensity():
    given = [3.0, 2.0, 1.0], log_times([3.0, 2.0, 1.0], 0.0, 0.0), [0.0] * 3
    _, exact = limit_of(*given)
    _, error = limit_of(*given, [[0.5, 0.5, 0.5], [-0.1, -0.15, -0.3]])
    assert error - exact == pytest.approx(0.5 * 1.0 + 0.3)
    _, growing = limit_of(*given, [[0.0, 0.0, 0.3]])  # two straight lines through ln τ differ by twice as much
    assert growing - exact == pytest.approx(0.6)
