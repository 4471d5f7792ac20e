"""Bounds and findings where a polished path and the graph give the energy of one exit."""

import dataclasses
import math
from types import SimpleNamespace

import numpy as np
import pytest

from vibrokit.analyzers.agreement import compared
from vibrokit.results.codes import Code
from vibrokit.results.energy import ActivationEnergy, Bound, Certificate, ExitPath

ORBIT = SimpleNamespace(label=0, repeats=True)
CHAOS = SimpleNamespace(label=0, repeats=False)
ERROR = 1e-9


CERTIFICATE = Certificate(1e-12, 1e-4, 1e-4, 20.0, 1e-10, 1e-10, 1e-10, 0.1)


def path(value, target=1, certificate=CERTIFICATE):
    return ActivationEnergy(
        0, target, value, 0.0, value + ERROR, "least action", Bound.UPPER, ERROR,
        residual=1e-12, certificate=certificate,
    )  # fmt: skip


def graph(value, error, target=1):
    return ActivationEnergy(
        0, target, value, max(0.0, value - error), value + error, "graph", Bound.ESTIMATE, numerical_error=error
    )  # fmt: skip


def combined(*given, **more):
    """Energies and findings."""
    found = compared(*given, **more)
    return tuple(one.energy for one in found), tuple(one.finding for one in found)


def only(attractor, paths, estimates):
    (energy,), (finding,) = combined(attractor, paths, estimates)
    return energy, finding


def test_a_path_to_a_set_gives_a_bracket():
    bound = dataclasses.replace(path(1.0), bound=Bound.BRACKET)
    energy, finding = only(ORBIT, (bound,), (graph(0.9, 0.2),))
    assert (finding.code, energy.bound) == (Code.BRACKET, Bound.BRACKET)
    assert (energy.lower, energy.value, energy.upper) == (pytest.approx(0.7), 0.9, 1.0 + ERROR)


@pytest.mark.parametrize(
    ("estimate", "code", "lower"),
    [
        ((1.01, 0.02), Code.AGREEMENT, 0.99),
        ((1.01, 0.01 + 1e-9), Code.AGREEMENT, 1.0 - ERROR),
        ((0.95, 0.1), Code.AGREEMENT, 0.85),
        ((1.0, 0.8), Code.GRAPH_TOO_COARSE, 0.2),
        ((1.3, 1.5), Code.GRAPH_TOO_COARSE, 0.0),
        ((1.2, 0.05), Code.GRAPH_TOO_COARSE, 0.8),
        ((0.9, 0.01), Code.CHEAPER_PATH_EXPECTED, 0.8),
        ((0.3, 0.1), Code.CHEAPER_PATH_EXPECTED, 0.0),
    ],
    ids=str,
)
def test_the_lower_bound_is_what_the_graph_supports(estimate, code, lower):
    """Where the graph is further off than its error, the difference stands for that."""
    energy, finding = only(ORBIT, (path(1.0),), (graph(*estimate),))
    assert finding.code is code
    assert (finding.source, finding.target) == (0, 1)
    assert finding.values == {"graph": estimate[0], "error": estimate[1], "path": 1.0}
    assert (energy.value, energy.method, energy.residual) == (1.0, "least action", 1e-12)
    assert energy.lower == pytest.approx(lower, abs=1e-12)
    assert energy.upper == 1.0 + ERROR
    assert energy.bound is (Bound.CERTIFIED if code is Code.AGREEMENT else Bound.UPPER)


def test_the_cheapest_path_of_each_target_counts():
    energies, findings = combined(
        ORBIT, (path(1.0), path(1.5), path(2.0, target=-1)), (graph(2.1, 0.2, -1), graph(1.0, 0.1))
    )  # fmt: skip
    assert [(energy.target, energy.value) for energy in energies] == [(1, 1.0), (-1, 2.0)]
    assert [finding.target for finding in findings] == [1, -1]


def test_a_path_without_a_certificate_certifies_nothing():
    energy, finding = only(ORBIT, (path(1.0, certificate=None),), (graph(1.01, 0.02),))
    assert finding.code is Code.AGREEMENT
    assert (energy.bound, energy.lower) == (Bound.UPPER, pytest.approx(0.99))


def test_a_vague_graph_is_not_the_energy_of_a_set():
    """Its lower bound holds, but its value says nothing."""
    energy, _ = only(CHAOS, (path(1.0),), (graph(0.1, 3.9),))
    assert (energy.value, energy.lower, energy.bound) == (1.0, 0.0, Bound.BRACKET)
    assert energy.numerical_error == ERROR


@pytest.mark.parametrize(("value", "error", "lower"), [(1.04, 0.05, 0.99), (1.1, 0.2, 0.9), (1.1, 0.05, 0.9)])
def test_a_graph_above_a_path_by_more_than_its_error_has_the_difference_as_error(value, error, lower):
    bound = dataclasses.replace(path(1.0), bound=Bound.BRACKET)
    ((energy,), _) = combined(ORBIT, [bound], [graph(value, error)])
    assert energy.value == 1.0
    assert energy.lower == pytest.approx(lower)


def test_the_energy_of_a_set_is_a_bracket():
    energy, finding = only(CHAOS, (path(1.0),), (graph(0.9, 0.2),))
    assert finding.code is Code.BRACKET
    assert energy.bound is Bound.BRACKET
    assert (energy.value, energy.numerical_error) == (0.9, 0.2)
    assert (energy.lower, energy.upper) == pytest.approx((0.7, 1.0))
    energy, _ = only(CHAOS, (path(1.0),), (graph(1.1, 0.2),))
    assert (energy.value, energy.numerical_error) == (1.0, ERROR)


def test_without_a_path_there_is_the_graph_s_estimate():
    estimate = graph(0.9, 0.2)
    energy, finding = only(ORBIT, (), (estimate,))
    assert energy is estimate
    assert finding.code is Code.NO_POLISHED_PATH
    assert finding.values == {"graph": 0.9, "error": 0.2}


@pytest.mark.parametrize(
    ("estimate", "expected"),
    [((0.003, 0.6), (0.0, 1.0, 1.1)), ((0.95, 0.1), (0.85, 0.95, 1.1)), ((2.0, 0.1), (0.0, 1.0, 1.1)), (None, None)],
    ids=str,
)
def test_a_path_of_the_action_plot_bounds_the_energy_where_none_was_polished(estimate, expected):
    shot = ActivationEnergy(0, 1, 1.0, 0.0, 1.1, "action plot", Bound.UPPER, numerical_error=0.1)
    estimates = () if estimate is None else (graph(*estimate),)
    (energy,), (finding,) = combined(ORBIT, (), estimates, shots=[shot])
    assert finding.code is Code.NOT_POLISHED
    assert finding.values["shot"] == 1.0
    assert energy.bound is Bound.UPPER
    assert (energy.lower, energy.value, energy.upper) == pytest.approx(expected or (0.0, 1.0, 1.1))
    (polished,), _ = combined(ORBIT, (path(0.9),), estimates, shots=[shot])
    assert polished.value == 0.9


def least(value, bound=Bound.ESTIMATE):
    upper = value + ERROR if bound is Bound.EXACT else math.inf
    return ActivationEnergy(0, 1, value, value - ERROR, upper, "detailed balance", bound, ERROR)


@pytest.mark.parametrize(
    ("value", "error", "estimate", "expected"),
    [
        (0.9999, math.nan, None, (1.0 - ERROR, 1.0, 1.0001)),  # no path costs less than 1: the error was not known
        (1.05, 0.05, (0.5, 0.05), (1.0 - ERROR, 1.0, 1.1)),
        (1.05, math.nan, (0.5, 0.05), (1.0 - ERROR, 1.0, 1.05)),
        (1.3, 0.1, (1.2, 0.05), (1.15, 1.2, 1.4)),
    ],
)
def test_a_path_of_the_action_plot_costs_no_less_than_possible(value, error, estimate, expected):
    path_ = ExitPath(*np.zeros((4, 2)), np.zeros(0, dtype=np.int64))
    upper = value if math.isnan(error) else value + error
    shot = ActivationEnergy(
        0, 1, value, 0.0, upper, "action plot", Bound.UPPER, numerical_error=error, path=path_
    )  # fmt: skip
    estimates = () if estimate is None else (graph(*estimate),)
    (energy,), _ = combined(ORBIT, (), estimates, least=[least(1.0)], shots=[shot])
    assert energy.lower <= energy.value <= energy.upper
    assert (energy.lower, energy.value, energy.upper) == pytest.approx(expected)


NEAR = [1 + 1.9e-9, 1 - 1.9e-9]  # the errors of both are 1e-9
NOT_SO_NEAR = [1 + 1e-6, 1.002, 1.0099, 0.999]


@pytest.mark.parametrize(("value", "attains"), [(x, True) for x in NEAR] + [(x, False) for x in NOT_SO_NEAR])
def test_near_the_proven_minimum_is_not_the_proven_minimum(value, attains):
    """A path certifies the minimum within the numerical errors of both; otherwise the two are upper and lower bound."""
    (energy,), (finding,) = combined(ORBIT, (path(value),), (), least=[least(1.0, Bound.EXACT)])
    assert (finding.code is Code.DETAILED_BALANCE) is attains
    assert energy.value == (max(value, 1.0) if attains else 1.0)
    assert energy.bound is (Bound.CERTIFIED if attains else Bound.EXACT)
    (energy,), (finding,) = combined(ORBIT, (path(value),), (), least=[least(1.0)])  # perhaps not attained
    assert (finding.code, energy.bound) == (
        (Code.DETAILED_BALANCE, Bound.CERTIFIED) if attains else (Code.NOT_SEARCHED, Bound.UPPER)
    )
    assert energy.lower == pytest.approx(1.0, abs=2 * ERROR)
    assert energy.lower <= 1.0 <= energy.upper
    assert energy.value == max(value, 1.0)


def test_a_path_without_an_error_does_not_attain_the_proven_minimum():
    unknown = dataclasses.replace(path(1.0), numerical_error=math.nan)
    (energy,), _ = combined(ORBIT, (unknown,), (), least=[least(1.0)])
    assert energy.bound is Bound.UPPER


def test_an_exact_energy_is_not_replaced_by_a_costlier_path():
    (energy,), (finding,) = combined(ORBIT, (path(1.7),), (), least=[least(1.0, Bound.EXACT)])
    assert (finding.code, energy.value, energy.bound) == (Code.BARRIER_ENERGY, 1.0, Bound.EXACT)
    (energy,), (finding,) = combined(ORBIT, (path(1.0),), (), least=[least(1.0, Bound.EXACT)])
    assert (finding.code, energy.value, energy.bound) == (Code.DETAILED_BALANCE, 1.0, Bound.CERTIFIED)


@pytest.mark.parametrize("attractor", [ORBIT, CHAOS], ids=["orbit", "set"])
def test_without_a_graph_nothing_excludes_a_cheaper_path(attractor):
    energy, finding = only(attractor, (path(1.0),), ())
    assert finding.code is Code.NOT_SEARCHED
    assert (energy.value, energy.lower, energy.bound) == (1.0, 0.0, Bound.UPPER)
    assert math.isclose(energy.upper, 1.0, rel_tol=2 * ERROR)


def test_every_finding_makes_a_sentence():
    cases = [((path(1.0),), (graph(1.0, 0.1),)), ((), (graph(1.0, 0.1),)), ((path(1.0),), ())]
    for attractor in (ORBIT, CHAOS):
        for paths, estimates in cases:
            _, finding = only(attractor, paths, estimates)
            assert finding.sentence(("rest", "clear")).startswith("From rest to clear")
