"""The limit D → 0 of D ln τ."""

import numpy as np
import pytest

from vibrokit.analyzers.sgcm.energies import extrapolated

INTENSITIES = np.array([3.0, 2.0, 1.0])


def test_a_straight_line_is_extrapolated_exactly():
    value, error = extrapolated(INTENSITIES, (5.0 + 0.7 * INTENSITIES) / INTENSITIES, [0.0] * 3)
    assert value == pytest.approx(5.0)
    assert error == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("bend", [0.1, -0.1])
def test_the_error_of_a_parabola_contains_its_limit(bend):
    value, error = extrapolated(INTENSITIES, (5.0 + 0.7 * INTENSITIES + bend * INTENSITIES**2) / INTENSITIES, [0.0] * 3)
    assert abs(value - 5.0) <= error


def test_errors_of_rates_are_those_of_the_straight_line():
    _, error = extrapolated(INTENSITIES, 5.0 / INTENSITIES, [0.0, 0.03, 0.01])
    assert error == pytest.approx(np.hypot(2 * 0.01 * 1, 1 * 0.03 * 2))


def test_one_intensity_has_an_error_of_three_times_itself():
    value, error = extrapolated([2.0], [4.0], [0.1])
    assert (value, error) == (8.0, pytest.approx(6.2))


@pytest.mark.parametrize("bend", [0.2, -0.2])
def test_the_error_from_two_intensities_contains_the_limit_of_a_prefactor_like_kramers(bend):
    """The first correction of Kramers' formula is of the order of D/ΔU, here 1/5 of D."""
    d = np.array([1.0, 0.7])
    value, error = extrapolated(d, (5.0 + 0.01 * d + bend * d**2) / d, [0.0, 0.0])
    assert abs(value - 5.0) <= error
