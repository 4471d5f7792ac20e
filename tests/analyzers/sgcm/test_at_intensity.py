"""Rates by the committor, and their errors from nodes, steps and sets."""

import math

import numpy as np
import pytest

from vibrokit.analyzers.sgcm.at_intensity import COARSER, AtIntensity
from vibrokit.analyzers.sgcm.committor import Committor
from vibrokit.analyzers.sgcm.cores import CoreSets
from vibrokit.analyzers.sgcm.quasi_stationary import QuasiStationary

NONE = np.empty((0, 0))
CORES, POSITION = CoreSets(NONE, {1: NONE}, NONE, None, NONE), CoreSets(NONE, {}, NONE, -1, NONE)
DENSITY = QuasiStationary(NONE, NONE, {1: -9.0}, NONE, 0.0, 0.3, True, 0.0, 10)  # what it loses is no rate


def committors(log_rate, change=0.0):
    """With target 1, without arrays."""
    return {} if log_rate is None else {1: Committor(NONE, log_rate, change, True)}


def solution(log_rate, change=0.0, cores=CORES, **more):
    return AtIntensity(1.0, None, DENSITY, None, cores, committors(log_rate, change), **more)


def solved(own, coarser, fewer_steps, other_sets, **more):
    changed = {"fewer_steps": committors(fewer_steps), "other_sets": committors(other_sets)}
    return solution(own, coarser=solution(coarser), **changed, **more)


def test_the_rate_is_that_of_the_committor_and_other_cores_are_no_error_of_it():
    found = solved(-5.0, -5.1, -5.3, -4.6, change=0.01)
    assert found.log_rates == {1: -5.0}
    np.testing.assert_allclose(found.changes(1), [0.1, 0.2, 0.0, 0.5])
    assert found.errors[1] == pytest.approx(0.1 + 0.2 + 0.01)


def test_what_returns_from_a_basin_is_an_error():
    found = solved(-5.0, -5.1, -5.1, -5.1, nearer=committors(-5.07))
    assert found.errors[1] == pytest.approx(0.1 + 0.03)


def test_basins_known_by_cells_are_an_error():
    assert solved(-5.0, -5.1, -5.1, -4.6, sets_resolved=False).errors[1] == pytest.approx(0.6)


@pytest.mark.parametrize(("order", "times"), [(2, 1.0), (4, 3.0)])
def test_errors_of_the_second_to_the_fourth_order_are_stated_once_to_three_times(order, times):
    error = 0.02
    found = solved(-5.0 - error, -5.0 - error * COARSER**order, -5.0 - error * COARSER**order, -5.0)
    assert found.errors[1] == pytest.approx(times * error)


def test_where_position_decides_there_are_no_other_sets():
    assert solved(-5.0, -5.1, -5.1, None, cores=POSITION).changes(1)[3] == 0.0


@pytest.mark.parametrize(
    "found",
    [
        solved(-math.inf, -math.inf, -math.inf, -5.0),
        solved(-5.0, -math.inf, -5.0, -5.0),
        solved(-5.0, None, -5.0, -5.0),
        solved(-5.0, -5.0, None, -5.0),
        solution(-5.0),
    ],
)
def test_a_rate_that_one_solution_lacks_has_no_error(found):
    assert found.errors[1] == math.inf
    assert not math.isnan(found.log_rates[1])
