"""What is found at one intensity: rates by the committor, their errors, and the limit D → 0 of D ln τ."""

import math

import numpy as np
import pytest

from vibrokit.analyzers.sgcm.at_intensity import AtIntensity, limit_of
from vibrokit.analyzers.sgcm.quasi_stationary import Committor
from vibrokit.analyzers.sgcm.solution import COARSER

ENERGY = 5.0
LADDERS = [(1.5, 1.2, 1.0), (1.0, 0.7), (2.5, 0.8, 0.4, 0.25), (1.2, 0.3)]


def committors(log_rate, change=0.0):
    """With target 1, without arrays."""
    return {} if log_rate is None else {1: Committor(np.empty((0, 0)), log_rate, change, True)}


def solved(own, coarser, fewer_steps, change=0.0, **others):
    changed = {name: committors(log_rate) for name, log_rate in others.items()}
    coarse = AtIntensity(None, committors(coarser))
    return AtIntensity(None, committors(own, change), coarse, committors(fewer_steps), **changed)


def test_the_rate_is_that_of_the_committor_and_larger_cores_are_no_error_of_it():
    found = solved(-5.0, -5.1, -5.3, 0.01, larger_cores=-4.6)
    assert found.log_rates == {1: -5.0}
    np.testing.assert_allclose(np.abs(found.changes(1)), [0.1, 0.2, 0.0, 0.5])
    assert found.errors[1] == pytest.approx(0.1 + 0.2 + 0.01)
    assert solved(-5.0, -5.1, -5.1, other_edges=-5.07).errors[1] == pytest.approx(0.1 + 0.03)  # of basins


@pytest.mark.parametrize(("order", "times"), [(2, 1.0), (4, 3.0)])
def test_errors_of_the_second_to_the_fourth_order_are_stated_once_to_three_times(order, times):
    error = 0.02
    found = solved(-5.0 - error, -5.0 - error * COARSER**order, -5.0 - error * COARSER**order)
    assert found.errors[1] == pytest.approx(times * error)


@pytest.mark.parametrize(
    "found",
    [
        solved(-math.inf, -math.inf, -math.inf), solved(-5.0, -math.inf, -5.0), solved(-5.0, -5.0, -math.inf),
        solved(-5.0, None, -5.0), solved(-5.0, -5.0, None), AtIntensity(None, committors(-5.0)),
    ],
)  # fmt: skip
def test_a_rate_that_one_solution_lacks_has_no_error(found):
    assert found.errors[1] == math.inf
    assert not math.isnan(found.log_rates[1])


def log_times(intensities, power=0.0, bend=0.0):
    """ln of D^−power exp(ΔU/D) with a correction of first order in D/ΔU, and a prefactor of 300."""
    d = np.array(intensities)
    return ENERGY / d - power * np.log(d) + bend * d / ENERGY + np.log(300.0)


def limit(intensities, *law):
    return limit_of(intensities, log_times(intensities, *law), [0.0] * len(intensities))


@pytest.mark.parametrize("intensities", LADDERS)
def test_a_straight_line_is_extrapolated_exactly(intensities):
    value, error = limit(intensities)
    assert value == pytest.approx(ENERGY, rel=1e-12)
    assert (error == np.inf) == (len(intensities) == 2)  # two do not show how the prefactor depends on the noise


PREFACTORS = [*((power, 0.0) for power in (-1.0, -0.5, 0.0, 0.5, 1.0)), (0.0, 1.0), (0.0, -1.0)]


@pytest.mark.parametrize("intensities", LADDERS)
@pytest.mark.parametrize(("power", "bend"), PREFACTORS)
def test_the_error_contains_the_limit_of_a_power_of_the_noise_and_of_the_next_order(intensities, power, bend):
    value, error = limit(intensities, power, bend)
    assert abs(value - ENERGY) <= error * (1 + 1e-9)
    assert bend or error <= 1.5 * intensities[-2] or len(intensities) == 2


@pytest.mark.parametrize("power", [2.0, -3.0])
def test_three_intensities_show_a_larger_power(power):
    value, error = limit(LADDERS[0], power)
    assert abs(value - ENERGY) <= error * (1 + 1e-9)
    assert error > LADDERS[0][-2]


def test_errors_of_rates_are_those_of_the_straight_line_and_common_changes_those_at_the_least_intensity():
    given = [3.0, 2.0, 1.0], log_times([3.0, 2.0, 1.0])
    _, exact = limit_of(*given, [0.0] * 3)
    _, error = limit_of(*given, [0.0, 0.03, 0.01])
    assert error - exact == pytest.approx(np.hypot(2 * 0.01 * 1, 1 * 0.03 * 2))
    _, error = limit_of(*given, [0.0] * 3, [[0.5, 0.5, 0.5], [-0.1, -0.15, -0.3]])
    assert error - exact == pytest.approx(0.5 * 1.0 + 0.3)
    _, growing = limit_of(*given, [0.0] * 3, [[0.0, 0.0, 0.3]])  # two straight lines through ln τ differ by twice that
    assert growing - exact == pytest.approx(0.6)
