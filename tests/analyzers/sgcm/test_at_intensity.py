"""Rates and their errors from two grids."""

import math

import numpy as np
import pytest

from vibrokit.analyzers.sgcm.at_intensity import AtIntensity
from vibrokit.analyzers.sgcm.committor import Committor
from vibrokit.analyzers.sgcm.quasi_stationary import QuasiStationary

NONE = np.empty((0, 0))


def density(log_rates, change=0.0):
    return QuasiStationary(NONE, NONE, log_rates, 0.0, change, True, 0.0, 10)


def solution(by_density, by_committor, **more):
    """With target 1, without arrays."""
    committors = {1: Committor(NONE, by_committor, 0.0, True)}
    return AtIntensity(1.0, None, density({1: by_density}), None, None, committors, **more)


def test_errors_of_second_order_are_extrapolated_exactly():
    """ln rates −5 − 0.4 h² and −5 − 0.1 h², h = 1 and 1.5."""
    coarser = solution(-5.9, -5.225)
    found = solution(-5.4, -5.1, coarser=coarser, rougher=density({1: -5.9}))
    assert found.log_rates[1] == pytest.approx(-5.0)
    assert found.errors[1] == pytest.approx((0.5 + 0.125) / 2)


def test_errors_of_fourth_order_are_not_extrapolated_too_far():
    """ln rates −5 − 0.04 h⁴ and −5 − 0.01 h⁴."""
    coarser = solution(-5.2025, -5.050625)
    found = solution(-5.04, -5.01, coarser=coarser, rougher=density({1: -5.2025}))
    assert found.log_rates[1] == pytest.approx(-5.0)


def test_methods_that_grids_drive_apart_are_not_extrapolated():
    found = solution(-5.4, -5.1, coarser=solution(-5.5, -5.3), rougher=density({1: -5.7}))
    assert found.log_rates[1] == pytest.approx(-5.25)
    np.testing.assert_allclose(found.changes(1), [-0.3, 0.15, -0.2])


def test_sharp_sets_count_twice():
    given = {"coarser": solution(-5.5, -5.3), "rougher": density({1: -5.7})}
    errors = [solution(-5.4, -5.1, sharp=sharp, **given).errors[1] for sharp in (False, True)]
    assert errors[1] - errors[0] == pytest.approx(0.2)


@pytest.mark.parametrize(
    "found",
    [
        solution(-5.0, -math.inf, coarser=solution(-5.0, -math.inf), rougher=density({1: -5.0})),
        solution(-5.0, -5.0, coarser=solution(-5.0, -math.inf), rougher=density({1: -5.0})),
        solution(-5.0, -5.0, coarser=solution(-5.0, -5.0), rougher=density({})),
        solution(-5.0, -5.0),
    ],
)
def test_a_rate_that_one_solution_lacks_has_no_error(found):
    assert found.errors[1] == math.inf
    assert not math.isnan(found.log_rates[1])


def test_a_target_that_the_coarser_grid_lacks_has_no_error():
    coarser = AtIntensity(1.0, None, density({}), None, None, {})
    assert solution(-5.0, -5.0, coarser=coarser, rougher=density({})).errors[1] == math.inf
