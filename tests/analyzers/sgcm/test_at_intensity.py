"""Rates by the committor, and their errors from nodes, steps and sets."""

import math

import numpy as np
import pytest

from vibrokit.analyzers.sgcm.at_intensity import AtIntensity
from vibrokit.analyzers.sgcm.quasi_stationary import Committor
from vibrokit.analyzers.sgcm.solution import COARSER


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


def test_other_edges_of_basins_are_an_error():
    assert solved(-5.0, -5.1, -5.1, other_edges=-5.07).errors[1] == pytest.approx(0.1 + 0.03)


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
