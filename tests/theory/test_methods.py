"""The worked numbers of docs/theory/methods.rst."""

import itertools
import math

import numpy as np
import pytest

import vibrokit as vk
from tests.test_tables import table

FACTOR = 0.2  # 4ζω_n


def potential(x):
    return x**6 / 24 - 5 * x**4 / 16 + x**2 / 2


OUTER = FACTOR * (potential(1) - potential(2))
MIDDLE = FACTOR * potential(1)


def energies(direct):
    """Between L, M and R; a direct exit between L and R costs `direct`."""
    return np.array([[0, OUTER, direct], [MIDDLE, 0, MIDDLE], [direct, OUTER, 0]])


def trees(root):
    """All maps of the other two attractors that lead to the root."""
    others = [one for one in range(3) if one != root]
    for ends in itertools.product(range(3), repeat=2):
        arrows = dict(zip(others, ends, strict=True))
        if all(one != end for one, end in arrows.items()) and any(end == root for end in ends):
            yield arrows


def test_energies_of_three_wells():
    assert pytest.approx(0.1125, rel=1e-14) == OUTER
    assert pytest.approx(0.0458333333333, rel=1e-11) == MIDDLE


@pytest.mark.parametrize("direct", [math.inf, 0.1169217256])
def test_weights_of_three_wells_by_hand(direct):
    costs = energies(direct)
    sums = [min(sum(costs[one, end] for one, end in arrows.items()) for arrows in trees(root)) for root in range(3)]
    assert sums == pytest.approx([OUTER + MIDDLE, 2 * OUTER, OUTER + MIDDLE])
    transitions = vk.Transitions(("L", "M", "R"), costs, costs.copy(), costs.copy())
    np.testing.assert_allclose(transitions.weights, [0, FACTOR / 3, 0], atol=1e-15)
    assert FACTOR * (potential(0) - potential(2)) == pytest.approx(FACTOR / 3)  # the stationary density
    first = transitions.cycle_hierarchy[0]
    assert (first.source, first.energy) == (1, MIDDLE)


def test_each_attractor_has_three_trees():
    assert [len(list(trees(root))) for root in range(3)] == [3, 3, 3]


def test_products_over_trees_are_the_stationary_probabilities():
    """The matrix-tree theorem, for any rates."""
    rates = np.random.default_rng(2).exponential(size=(3, 3))
    np.fill_diagonal(rates, 0.0)
    products = [
        sum(math.prod(rates[one, end] for one, end in arrows.items()) for arrows in trees(root)) for root in range(3)
    ]
    shares = np.array(products) / sum(products)
    np.testing.assert_allclose(shares * rates.sum(axis=1), shares @ rates, rtol=1e-12)


def test_a_chi_squared_sum_of_independent_errors_raises_false_alarms_as_often_as_stated():
    from scipy.stats import chi2

    random, errors = np.random.default_rng(3), np.array([0.05, 0.1, 0.2])
    differences = random.standard_normal((20_000, 3)) * np.hypot(errors, 0.05)
    sums = (differences**2 / (errors**2 + 0.05**2)).sum(axis=1)
    alarms = (chi2.sf(sums, 3) < 0.01).sum()
    assert abs(alarms - 200) < 4 * math.sqrt(200)


def test_errors_of_certified_paths_are_mostly_below_1e_8():
    rows = [row for row in table("gallery").rows if row["bound"] == "certified"]
    errors = np.array([float(row["error"]) / float(row["energy"]) for row in rows])
    assert np.mean(errors < 1e-8) > 0.9


def test_splitting_has_rates_up_to_16():
    """Each agrees with the spectrum, as the tests of the tables show."""
    assert max(float(row["ratio"]) for row in table("klein_kramers").rows) == 16
