import itertools
import math

import mpmath
import numpy as np
import pytest

from tests.layers import long
from vibrokit.comparison.in_trees import tree_costs
from vibrokit.comparison.transitions import Transitions
from vibrokit.errors import StructureError
from vibrokit.results.energy import ActivationEnergy, Bound
from vibrokit.results.result import Result
from vibrokit.results.section import Section

INF = math.inf
NAMES = tuple("abcdefghijkl")
# Worked by hand. W_0 = V21 + V10 = 3.5, W_1 = V01 + V21 = 2.5, W_2 = V01 + V12 = 4.
THREE = [[0, 1, 5], [2, 0, 3], [4, 1.5, 0]]
# A chain 0 – 1 – 2 – 3 has one tree for each root: W = 2+4+6, 1+4+6, 1+3+6, 1+3+5.
CHAIN = [[0, 1, INF, INF], [2, 0, 3, INF], [INF, 4, 0, 5], [INF, INF, 6, 0]]


def exact(energies):
    values = np.array(energies, dtype=float)
    return Transitions(NAMES[: len(values)], values, values.copy(), values.copy())


def between(lower, upper):
    lower, upper = np.array(lower, dtype=float), np.array(upper, dtype=float)
    return Transitions(NAMES[: len(lower)], (lower + upper) / 2, lower, upper)


def all_tree_costs(energies, root):
    """Costs of every in-tree, by trying every choice of one arc for each other node."""
    nodes = [node for node in range(len(energies)) if node != root]
    for ends in itertools.product(range(len(energies)), repeat=len(nodes)):
        arcs = dict(zip(nodes, ends, strict=True))
        for node in nodes:
            for _ in nodes:
                node = arcs.get(node, root)
            if node != root:
                break
        else:
            yield math.fsum(energies[i][j] for i, j in arcs.items())


def brute_weights(energies):
    costs = np.array([min(all_tree_costs(energies, root), default=0.0) for root in range(len(energies))])
    return costs - costs.min()


def jump_generator(energies, intensity):
    """Generator of jumps at rates exp(−V/D), to many digits."""
    mpmath.mp.dps = 1500
    count = len(energies)
    rates = mpmath.matrix(count, count)
    for i, j in itertools.permutations(range(count), 2):
        rates[i, j] = mpmath.exp(-mpmath.mpf(float(energies[i][j])) / intensity)
    for i in range(count):
        rates[i, i] = -sum(rates[i, :])
    return rates


def energy(source, target, value, error=0.0):
    return ActivationEnergy(source, target, value, value - error, value + error, "test", Bound.CERTIFIED)


def result(count, *energies, scene="one"):
    section = Section(labels=np.zeros((1, 1), dtype=np.int16), bounds=np.zeros((2, 2)), points=(), names=NAMES[:count])
    return Result(energies=energies, section=section, scene={"name": scene})


# Weights


@pytest.mark.parametrize(
    ("energies", "weights"),
    [
        ([[0]], [0]),
        ([[0, 3], [5, 0]], [2, 0]),
        (THREE, [1, 0, 1.5]),
        (CHAIN, [3, 2, 1, 0]),
    ],
)
def test_weights_worked_by_hand(energies, weights):
    transitions = exact(energies)
    np.testing.assert_array_equal(transitions.weights, weights)
    np.testing.assert_array_equal(transitions.weight_bounds, [weights, weights])
    assert transitions.most_stable == int(np.argmin(weights))


@pytest.mark.parametrize("seed", range(40))
def test_the_cheapest_tree_is_that_of_trying_all(seed):
    random = np.random.default_rng(seed)
    count = int(random.integers(2, 6))
    costs = random.exponential(size=(count, count)).round(random.integers(0, 5))  # coarse rounding makes ties
    costs[random.random((count, count)) < 0.25] = INF
    np.fill_diagonal(costs, 0.0)
    before = costs.copy()
    for root in range(count):
        least = min((c for c in all_tree_costs(costs, root) if math.isfinite(c)), default=INF)
        assert tree_costs(costs)[root] == pytest.approx(least, rel=1e-14)
    np.testing.assert_array_equal(costs, before)


def test_stationary_weights_are_those_of_the_jump_process():
    """Jumps at rates exp(−V/D): the null vector of the generator, to the order of its exponents."""
    intensity = 0.01
    generator = jump_generator(THREE, intensity)
    for row in range(3):
        generator[row, 0] = 1  # one balance is that of the others; in its place, all shares make 1
    shares = mpmath.lu_solve(generator.T, mpmath.matrix([1, 0, 0]))
    exponents = np.array([float(-intensity * mpmath.log(share)) for share in shares])
    found = exact(THREE).stationary_weights(intensity)
    np.testing.assert_allclose(-intensity * found.exponents, exponents, atol=intensity * math.log(3))
    np.testing.assert_array_equal(found.exponents, -exact(THREE).weights / intensity)


def test_tiny_noise_does_not_overflow():
    with np.errstate(all="raise"):
        found = exact(THREE).stationary_weights(1e-310).exponents
    np.testing.assert_array_equal(found, [-INF, 0, -INF])


def test_prefactors_are_not_in_the_exponents():
    """From rates the share of b is 1.75e-19: its exponent alone would make 9e-17 of it, so no share is shown."""
    found = exact([[0, 36.9], [0, 0]]).stationary_weights(1.0)
    assert found.exponents.tolist() == [0.0, -36.9]
    assert str(found).endswith("up to unknown prefactors: a 0, b -36.9.")
    assert between([[0, 36.0], [0, 0]], [[0, 37.0], [0, 0]]).stationary_weights(1.0).lower[1] == -37.0


# Bounds


@pytest.mark.parametrize(("seed", "count"), [(0, 2), (1, 3), (2, 3), (3, 4), long(4, 5)])
def test_bounds_hold_for_all_energies_between(seed, count):
    random = np.random.default_rng(seed)
    lower = random.exponential(size=(count, count))
    upper = lower + random.exponential(size=(count, count)) * (random.random((count, count)) < 0.6)
    for matrix in (lower, upper):
        np.fill_diagonal(matrix, 0.0)
    transitions = between(lower, upper)
    low, high = transitions.weight_bounds
    intensity = 0.3
    found = transitions.stationary_weights(intensity)
    for _ in range(300):
        share = random.random((count, count)).round(random.integers(0, 2))  # many of them at corners
        weights = brute_weights(lower + share * (upper - lower))
        assert (low <= weights + 1e-12).all()
        assert (weights <= high + 1e-12).all()
        assert (found.lower <= -weights / intensity + 1e-12).all()
        assert (-weights / intensity <= found.upper + 1e-12).all()
        assert int(np.argmin(weights)) in transitions.leading


def test_bounds_of_two_are_reached():
    low, high = between([[0, 1], [4, 0]], [[0, 2], [7, 0]]).weight_bounds
    np.testing.assert_array_equal(low, [2, 0])
    np.testing.assert_array_equal(high, [6, 0])


def test_a_bracket_that_all_trees_share_changes_nothing():
    """A chaotic attractor 2 from which all goes to 1: what it costs is in the trees of 0 and 1 alike."""
    lower = [[0, 1, 9], [2, 0, 9], [9, 3, 0]]
    upper = [[0, 1, 9], [2, 0, 9], [9, 5, 0]]
    transitions = between(lower, upper)
    assert transitions.weight_bounds[0][:2].tolist() == transitions.weight_bounds[1][:2].tolist() == [1, 0]
    assert transitions.most_stable == 1


def test_overlapping_brackets_do_not_decide():
    transitions = between([[0, 1], [1.4, 0]], [[0, 2], [1.5, 0]])
    assert transitions.most_stable is None
    assert transitions.leading == (0, 1)
    assert "a, b" in transitions.verdict
    assert exact([[0, 1], [1, 0]]).leading == (0, 1)


# What was not found


def test_an_attractor_without_a_known_exit_leaves_all_open():
    transitions = exact([[0, 1, 2], [INF, 0, INF], [3, 1, 0]])
    assert transitions.missing == (1,)
    assert transitions.most_stable is None
    assert transitions.leading == ()
    assert np.isnan(transitions.weights).all()
    assert np.isnan(transitions.stationary_weights(1.0).exponents).all()
    assert "No exit from b" in transitions.verdict
    assert "not known" in str(transitions.stationary_weights(1.0))
    assert [(cycle.members, cycle.target) for cycle in transitions.cycle_hierarchy] == [((0,), 1), ((2,), 1)]
    pairs = [[0, 1, INF, INF], [1, 0, INF, INF], [INF, INF, 0, 1], [INF, INF, 1, 0]]  # nothing joins the two
    assert (exact(pairs).missing, exact(pairs).known, exact(pairs).most_stable) == ((), False, None)


def test_an_attractor_that_is_not_reached_has_weight_zero():
    transitions = exact([[0, 1, INF], [2, 0, INF], [1, 1, 0]])
    assert transitions.weights.tolist() == [1, 0, INF]
    assert transitions.stationary_weights(0.1).exponents[2] == -INF
    assert "No path to c" in transitions.verdict


def test_none_and_one_attractor():
    assert exact(np.zeros((0, 0))).cycle_hierarchy == ()
    assert not exact(np.zeros((0, 0))).known
    alone = exact([[0]])
    assert alone.most_stable == 0
    assert alone.stationary_weights(1.0).exponents.tolist() == [0.0]


# Cycle hierarchy


def seen(transitions):
    return [(c.members, c.source, c.target, c.energy) for c in transitions.cycle_hierarchy]


def test_cycles_worked_by_hand():
    """The motion cycles between 0 and 1; the pair is left from 1, where it mostly is, for 2 at 3 (from 0: 1 + 5)."""
    assert seen(exact(THREE)) == [((0,), 0, 1, 1), ((2,), 2, 1, 1.5), ((1,), 1, 0, 2), ((0, 1), 1, 2, 3)]


def test_groups_within_groups():
    """Within the pair of 0 and 1 the weight of 0 has the exponent 1, so that it is left at min(1 + 4, 7) from 0."""
    energies = [[0, 1, 4, 9], [2, 0, 7, 9], [6, 9, 0, 9], [9, 9, 8, 0]]
    found = seen(exact(energies))
    assert found[:4] == [((0,), 0, 1, 1), ((1,), 1, 0, 2), ((0, 1), 0, 2, 5), ((2,), 2, 0, 6)]
    # W within {0, 1, 2}: to 0: 2 + 6, to 1: 1 + 6, to 2: 2 + 4 (0 → 2 and 1 → 0), so 2, 1, 0; left from 2 at 9.
    assert found[4:] == [((3,), 3, 2, 8), ((0, 1, 2), 2, 3, 9)]


def test_the_text_names_attractors_and_groups():
    text = str(exact(THREE))
    assert "a → b: 1\n" in text
    assert "b → c: 3, from the group a, b" in text
    assert "most stable attractor under weak noise is b" in text


def test_cycles_carry_their_bounds():
    (first, second) = between([[0, 1], [2, 0]], [[0, 1.5], [4, 0]]).cycle_hierarchy
    assert (first.lower, first.upper) == (1, 1.5)
    assert (second.lower, second.upper) == (2, 4)


@pytest.mark.parametrize("seed", range(6))
def test_groups_are_left_at_the_rate_of_the_jump_process(seed):
    """Mean times out of each group from the jump process itself: D log τ is the energy, to the order of D."""
    random = np.random.default_rng(seed)
    energies = random.uniform(0.5, 3.0, (4, 4))
    np.fill_diagonal(energies, 0.0)
    intensity = 0.005
    generator = jump_generator(energies, intensity)
    for cycle in exact(energies).cycle_hierarchy:
        inside = list(cycle.members)
        own = mpmath.matrix([[-generator[i, j] for j in inside] for i in inside])
        times = mpmath.lu_solve(own, mpmath.ones(len(inside), 1))
        longest = float(intensity * mpmath.log(max(times)))
        assert longest == pytest.approx(cycle.energy, abs=intensity * math.log(16))  # of at most 16 trees each


# Routes


def test_routes_lead_through_others_where_that_is_cheaper():
    transitions = exact(THREE)
    np.testing.assert_array_equal(transitions.quasi_potentials, [[0, 1, 4], [2, 0, 3], [3.5, 1.5, 0]])
    assert transitions.route(0, 2) == (0, 1, 2)
    assert transitions.route(2, 0) == (2, 1, 0)
    assert transitions.route(1, 1) == (1,)
    assert exact([[0, INF], [1, 0]]).route(0, 1) == ()
    assert exact([[0, 0, INF], [0, 0, 0], [INF, 0, 0]]).route(2, 0) == (2, 1, 0)  # at no cost
    assert transitions.route("a", "c") == (0, 1, 2)
    with pytest.raises(StructureError, match="no attractor 7"):
        transitions.route(0, 7)
    energies = np.random.default_rng(0).exponential(size=(6, 6)) ** 3
    np.fill_diagonal(energies, 0.0)
    transitions = exact(energies)
    for source, target in itertools.permutations(range(6), 2):
        route = transitions.route(source, target)
        cost = math.fsum(energies[a, b] for a, b in itertools.pairwise(route))
        assert (route[0], route[-1]) == (source, target)
        assert cost == pytest.approx(transitions.quasi_potentials[source, target], rel=1e-14)
    # Freidlin and Wentzell, chapter 6, section 4: routes through others change no weight.
    np.testing.assert_allclose(exact(transitions.quasi_potentials).weights, transitions.weights, atol=1e-12)


# From results


def test_the_least_energy_of_each_pair_is_collected():
    first = result(2, energy(0, 1, 3.0, 0.5), energy(1, 0, 4.0), energy(0, -1, 1.0))
    transitions = Transitions.of(first, result(2, energy(0, 1, 2.8, 0.1)))
    np.testing.assert_array_equal(transitions.energies, [[0, 2.8], [4, 0]])
    np.testing.assert_allclose(transitions.lower, [[0, 2.7], [4, 0]])
    np.testing.assert_allclose(transitions.upper, [[0, 2.9], [4, 0]])
    assert transitions.names == ("a", "b")


def test_an_attractor_that_was_not_analyzed_is_missing():
    transitions = Transitions.of(result(3, energy(0, 1, 1.0), energy(1, 0, 2.0)))
    assert transitions.missing == (2,)
    assert transitions.lower[2].tolist() == [0, 0, 0]
    assert np.isinf(transitions.upper[2, :2]).all()


def test_an_upper_bound_excludes_no_other_exit():
    """With nothing excluded, the exit from 0 to 2 may cost nothing: then W_2 = 5 and W_1 = 6."""
    upper = ActivationEnergy(0, 1, 1.0, 0.0, 1.0, "action plot", Bound.UPPER)
    transitions = Transitions.of(result(3, upper, energy(1, 0, 5.0), energy(2, 1, 6.0)))
    np.testing.assert_array_equal(transitions.lower, [[0, 0, 0], [5, 0, INF], [INF, 6, 0]])
    assert transitions.weights.tolist() == [4, 0, INF]
    assert transitions.leading == (1, 2)
    both = Transitions.of(result(2, upper, ActivationEnergy(1, 0, 5.0, 0.0, 5.0, "action plot", Bound.UPPER)))
    assert both.leading == (0, 1)
    assert [array.tolist() for array in both.weight_bounds] == [[0, 0], [5, 1]]


@pytest.mark.parametrize(
    "results",
    [
        (),
        (result(2),),
        (result(2, energy(0, -1, 1.0)),),
        (result(2, energy(0, 1, 1.0)), result(3, energy(0, 1, 1.0))),
        (result(2, energy(0, 1, 1.0)), result(2, energy(0, 1, 1.0), scene="two")),
    ],
)
def test_results_without_transitions_are_refused(results):
    with pytest.raises(StructureError, match="transitions"):
        Transitions.of(*results)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"names": ("a", "a")}, "must differ"),
        ({"lower": np.zeros((2, 3))}, "need lower, an array of numbers of shape"),
        ({"energies": np.array([[0, np.nan], [1, 0]])}, "no NaN"),
        ({"lower": np.array([[0, 2.0], [1, 0]])}, "lower ≤ energies"),
        ({"upper": np.zeros((2, 2))}, "energies ≤ upper"),
    ],
)
def test_what_is_no_transition_matrix_is_refused(change, words):
    values = np.array([[0.0, 1.0], [1.0, 0.0]])
    with pytest.raises(StructureError, match=words):
        Transitions(**({"names": ("a", "b"), "energies": values, "lower": values, "upper": values} | change))


@pytest.mark.parametrize("intensity", [0, -1.0, math.nan, math.inf])
def test_a_noise_intensity_must_be_positive(intensity):
    with pytest.raises(StructureError, match="noise intensity"):
        exact(THREE).stationary_weights(intensity)
