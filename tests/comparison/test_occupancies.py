"""Occupancies: balance of rates, states that are not metastable, errors, and exact distributions."""

import itertools
import math

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from scipy import integrate
from scipy.linalg import eig, null_space

import vibrokit as vk
from vibrokit.comparison.markov_chain import log_loss, log_stationary
from vibrokit.comparison.occupancies import Balance, shares_text
from vibrokit.results.codes import Code

NAMES = ("a", "b", "c", "d")


def balance(rates, errors=0.0, relaxations=1e-3, held=None, unknown=(), escapes=0.0):
    """A balance of rates with errors of ln of them; `unknown` are (from, to) of which nothing is known."""
    count = len(rates)
    with np.errstate(divide="ignore"):
        logs, escapes = np.log(np.array(rates, dtype=float)), np.log(np.broadcast_to(escapes, count))
    lower, upper = logs - errors, logs + errors
    for place in unknown:
        lower[place], upper[place] = -np.inf, np.inf
    shares = np.full((count, count), np.nan) if held is None else np.array(held)
    return Balance(NAMES[:count], logs, lower, upper, np.broadcast_to(relaxations, count), shares, escapes)


def exact(rates):
    null = null_space((rates - np.diag(rates.sum(axis=1))).T)[:, 0]
    return null / null.sum()


def remaining(rates, escapes):
    """Shares of what has not escaped, in the long run, and the rate at which it escapes: the slowest left mode."""
    values, vectors = eig((rates - np.diag(rates.sum(axis=1) + escapes)).T)
    slowest = np.argmax(values.real)
    return vectors[:, slowest].real / vectors[:, slowest].real.sum(), -values[slowest].real


RATES = np.random.default_rng(3).uniform(0.1, 2.0, (4, 4)) * (1 - np.eye(4))


def test_stationary_probabilities_are_the_null_space_of_the_generator():
    found = balance(RATES)
    np.testing.assert_allclose(np.exp(found.log_probabilities), exact(RATES), rtol=1e-12)
    value, lower, upper = found.shares
    for share in (value, lower, upper):
        np.testing.assert_allclose(share, exact(RATES), rtol=1e-12)


@pytest.mark.parametrize("weak", [1e3, 1e6, 1e12])
def test_shares_at_noise_of_any_weakness(weak):
    """ΔU/D of so many thousands: the states are not alike because no float holds their rates."""
    one = Balance(
        NAMES[:2], *[weak * np.array([[-np.inf, -20.0], [-19.0, -np.inf]])] * 3, np.full(2, 1e-3),
        np.full((2, 2), np.nan), np.full(2, -np.inf),
    )  # fmt: skip
    np.testing.assert_allclose(one.shares, [[1.0, 0.0]] * 3, atol=1e-300)


def test_a_state_that_is_never_left_is_refused_by_name():
    with pytest.raises(vk.errors.StructureError, match="no exit from b"):
        log_stationary(np.array([[-np.inf, 0.0], [-np.inf, -np.inf]]), NAMES)


def test_bounds_are_the_errors_of_the_rates():
    """Of rates that err by half of their bounds, as normal errors do, 95 % of the shares are within theirs."""
    rng, found = np.random.default_rng(1), balance(RATES, errors=0.4)
    _, lower, upper = found.shares
    tried = np.array([exact(RATES * np.exp(0.2 * rng.standard_normal((4, 4)))) for _ in range(2000)])
    inside = ((lower <= tried) & (tried <= upper)).mean(axis=0)
    assert (inside > 0.94).all()
    assert (inside < 0.99).all()


def test_a_rate_that_is_not_known_leaves_all_open():
    rates = np.array([[0.0, 1.0], [0.5, 0.0]])
    value, lower, upper = balance(rates, errors=0.1, unknown=[(0, 1)]).shares
    np.testing.assert_allclose(value, [1 / 3, 2 / 3])
    np.testing.assert_allclose(lower, 0.0, atol=1e-12)
    np.testing.assert_allclose(upper, 1.0)


def test_states_that_exchange_within_their_relaxation_are_one():
    """a and b have relaxation times of 1 and exchange at once; c is left rarely."""
    rates = np.array([[0.0, 2.0, 1e-3], [3.0, 0.0, 2e-3], [1e-2, 1e-3, 0.0]])
    found = balance(rates, relaxations=1.0)
    assert found.hosts.tolist() == [0, 0, 2]
    shares = exact(rates)
    np.testing.assert_allclose(found.shares[0], [shares[0] + shares[1], shares[2]])
    whole = balance(RATES, errors=0.3, relaxations=100.0)
    assert len(set(whole.hosts.tolist())) == 1
    np.testing.assert_allclose(whole.shares, 1.0)


def test_a_core_that_lies_in_other_basins_is_no_state():
    """No rates lead there, and it counts with the state that its core lies in."""
    rates = np.array([[0.0, 1.0, 0.0], [3.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    found = balance(rates, held=[[0.9, 0.1, 0.0], [0.2, 0.8, 0.0], [0.1, 0.6, 0.3]])
    assert found.hosts.tolist() == [0, 1, 1]
    np.testing.assert_allclose(found.shares[0], [0.75, 0.25])
    np.testing.assert_allclose(found.shares, [[0.75, 0.25]] * 3)


def test_what_lies_between_two_states_is_in_the_bounds_of_both():
    """b is left at once, for a and for c alike: it is divided between them, and either may have all of it."""
    rates = np.array([[0.0, 0.02, 0.0], [1.0, 0.0, 0.9], [0.0, 0.02, 0.0]])
    found = balance(rates, relaxations=1.0)
    assert found.hosts.tolist() == [0, 0, 2]
    value, lower, upper = found.shares
    shares = exact(rates)
    np.testing.assert_allclose(value, [shares[0] + shares[1] / 1.9, shares[2] + shares[1] * 0.9 / 1.9])
    np.testing.assert_allclose(lower, [shares[0], shares[2]])
    np.testing.assert_allclose(upper, [shares[0] + shares[1], shares[2] + shares[1]])
    assert found.states == ("a", "a and c", "c")


@pytest.mark.parametrize("quick", [1.0, 0.06])
def test_what_lies_between_mirror_images_gives_each_a_half(quick):
    """Also if rates differ by their errors, and if only both exits together are too quick for a state."""
    rates = np.array([[0.0, 1e-3, 0.0], [quick, 0.0, quick * (1 + 1e-6)], [0.0, 1e-3, 0.0]])
    found = balance(rates, relaxations=1.0)
    np.testing.assert_allclose(found.shares[0], 0.5, rtol=1e-5)
    assert found.states[1] == "a and c"


def test_several_that_pass_are_divided_by_where_they_lead_at_last():
    """From b to c in half of the cases; from there back to b or on to d, each in half."""
    rates = np.array([[0.0, 1e-3, 0.0, 0.0], [1.0, 0.0, 1.0, 0.0], [0.0, 1.0, 0.0, 1.0], [0.0, 0.0, 1e-3, 0.0]])
    found = balance(rates, relaxations=[1e-3, 1.0, 1e-9, 1.0])  # c lasts long, b does not
    shares = exact(rates)
    np.testing.assert_allclose(found.shares[0], [shares[0] + shares[1] / 2, shares[2] + shares[1] / 2, shares[3]])
    ladder = balance(rates, relaxations=[1e-3, 1e9, 10.0, 1e-3], held=np.eye(4))
    assert ladder.states == ("a", "a and d", "a and d", "d")
    np.testing.assert_allclose(
        ladder.shares[0], [shares[0] + shares[1:3] @ [2 / 3, 1 / 3], shares[3] + shares[1:3] @ [1 / 3, 2 / 3]]
    )


@pytest.mark.parametrize("seed", range(5))
def test_the_order_of_the_attractors_does_not_matter(seed):
    rng = np.random.default_rng(seed)
    rates = np.exp(rng.uniform(-8, 0, (4, 4))) * (1 - np.eye(4))
    relaxations = np.exp(rng.uniform(-3, 3, 4))
    found, mirrored = balance(rates, 0.2, relaxations), balance(rates[::-1, ::-1], 0.2, relaxations[::-1])
    heads = [np.unique(each.hosts) for each in (found, mirrored)]
    np.testing.assert_array_equal(heads[0], 3 - heads[1][::-1])
    np.testing.assert_allclose(found.shares, np.array(mirrored.shares)[:, ::-1], rtol=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_shares_are_of_what_has_not_escaped(seed):
    rng = np.random.default_rng(seed)
    rates = np.exp(rng.uniform(-3, 0, (4, 4))) * (1 - np.eye(4))
    escapes = rng.uniform(0, 0.004, 4) * [1, 1, 0, 1]
    found, (shares, rate) = balance(rates, escapes=escapes), remaining(rates, escapes)
    np.testing.assert_allclose(found.shares[0], shares, rtol=1e-9)
    assert found.log_escape_time == pytest.approx(-math.log(rate))


def test_an_escape_once_in_a_thousand_million_years_leaves_shares_as_they_are():
    found, rare = balance(RATES), balance(RATES, escapes=[0.0, 3e-17, 1e-300, 0.0])
    np.testing.assert_allclose(rare.shares, found.shares, rtol=1e-12)
    assert rare.log_escape_time == pytest.approx(-math.log(3e-17 * exact(RATES)[1]))
    quick = balance([[0.0, 2.0], [3.0, 0.0]], relaxations=1.0, escapes=1e-17)
    np.testing.assert_allclose(quick.shares[0], 1.0)


@pytest.mark.parametrize(
    ("rates", "escapes"),
    [
        ([[0.0, 1.0], [1.0, 0.0]], [0.0, 0.2]),  # in one of six cases
        ([[0.0, 1.0], [1e-9, 0.0]], [1e-8, 1e-8]),
        ([[0.0, 1e-9], [1.0, 0.0]], [1e-8, 0.0]),  # b is as good as never reached
        ([[0.0, 1.0, 0.0], [1.0, 0.0, 1e-9], [1e-12, 0.0, 0.0]], [1e-6, 0.0, 0.0]),  # nor is c, and c never escapes
        ([[0.0, 0.0], [0.0, 0.0]], [1e-9, 1e-9]),  # as of a first contact
        ([[0.0]], [1e-9]),
    ],
)
def test_escape_within_the_times_of_exchange_leaves_no_shares(rates, escapes):
    with pytest.raises(vk.errors.StructureError, match="does not come back"):
        _ = balance(rates, escapes=escapes).shares


def test_what_is_lost_on_the_way_is_that_of_the_chain():
    """Against the solution of the linear equations for the probability of absorption."""
    rng = np.random.default_rng(5)
    rates = np.exp(rng.uniform(-4, 0, (4, 5)))
    generator = rates[:, :4] * (1 - np.eye(4))
    left = generator.sum(axis=1) + rates[:, 4]
    for start, end in itertools.permutations(range(4), 2):
        others = [label for label in range(4) if label != end]
        lost = np.linalg.solve((np.diag(left) - generator)[np.ix_(others, others)], rates[others, 4])
        assert log_loss(np.log(rates), start, end) == pytest.approx(math.log(lost[others.index(start)]))


# --- whole scenes


def wells(roots, damping, temperature, **settings):
    """A force with these zeros, tops between wells; what MFET finds, and Boltzmann's shares between the tops."""
    force = Polynomial.fromroots(roots)
    energy = force.integ()
    formula = "*".join(f"(x - ({root}))" for root in roots)
    intensity = 4 * damping * temperature
    osc = vk.Oscillator(
        natural_frequency=1.0, damping_ratio=damping, spring=vk.CustomSpring(formula), noise=vk.WhiteNoise(intensity)
    )
    structure = vk.find_structure(osc, region=((-3, 3), (-3, 3)), cells=(80, 80), manifolds=False, rng=0)
    found = vk.MFET(intensities=(intensity,), escapes=0, splitting=False, **settings).run(osc, structure)
    places = [-6.0, *roots[1::2], 6.0]
    weights = [
        integrate.quad(lambda x: math.exp(-(energy(x) - energy(roots[0])) / temperature), *ends)[0]
        for ends in itertools.pairwise(places)
    ]
    order = np.argsort([attractor.points[0, 0] for attractor in structure.attractors])
    return vk.occupancies(found).isel(intensity=0, attractor=order), np.array(weights) / sum(weights), found


@pytest.mark.slow
def test_three_wells_have_the_shares_of_boltzmann():
    found, exact_shares, _ = wells([-2.0, -1.0, 0.0, 1.0, 2.0], 0.3, 0.3)
    assert (found["lower"].values <= exact_shares).all()
    assert (exact_shares <= found["upper"].values).all()


@pytest.mark.slow
def test_a_well_within_another_counts_with_it():
    """The barrier between the first two wells is an eighth of the temperature, that to the third four times as high."""
    found, exact_shares, result = wells([-2.0, -1.45, -1.1, 0.0, 0.8], 0.3, 0.1)
    assert Code.NOT_METASTABLE in {finding.code for finding in result.findings}
    first, second, third = found["state"].values.tolist()
    assert first == second != third
    assert int(np.isnan(found.values).sum()) == 1
    for share, state in ((exact_shares[:2].sum(), first), (exact_shares[2], third)):
        one = found.sel(attractor=state)
        assert float(one["lower"]) <= share <= float(one["upper"])
        assert float(one) == pytest.approx(share, abs=0.1)


def test_states_whose_exits_were_not_seen_are_refused():
    rates = np.array([[0.0, 2.0, 0.0], [3.0, 0.0, 0.0], [1e-2, 1e-3, 0.0]])
    with pytest.raises(vk.errors.StructureError, match="a, b exchange"):
        _ = balance(rates, relaxations=1.0, unknown=[(0, 2), (1, 2)]).shares


TUBE = vk.Oscillator(
    natural_frequency=250.7133, damping_ratio=0.008, excitations=(vk.Harmonic(17.142857, 408.407),),
    barriers=(vk.Barrier(vk.Linear(5.714286e6), 2.5e-4, "right"), vk.Barrier(vk.Linear(5.714286e6), -2.5e-4, "left")),
    noise=vk.WhiteNoise(4.0816e-3),
)  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize(
    "analyzer",
    [
        vk.MFET(escapes=0, target_error=0.2, intensities=(4.0816e-3,)),
        vk.SGCM(nodes=(160, 160), steps=64, intensities=(4.0816e-3,)),
    ],
    ids=["MFET", "SGCM"],
)
def test_an_orbit_whose_basin_is_far_smaller_than_its_core_has_no_share(analyzer):
    """A heat-exchanger tube: four runs of 20 000 noisy periods spend 99.4 % at hammering, none at its period three."""
    structure = vk.find_structure(TUBE, manifolds=False, rng=0)
    result = analyzer.run(TUBE, structure)
    found = vk.occupancies(result).isel(intensity=0)
    assert float(found.sel(attractor="hammering")) > 0.98
    assert math.isnan(found.sel(attractor="hammering-period-3"))
    assert str(found["state"].sel(attractor="hammering-period-3").values) == "hammering"
    assert "counted with hammering" in shares_text(found.expand_dims("intensity"))
    assert {Code.CORE_EXCEEDS_BASIN, Code.TARGET_EXCEEDS_BASIN} <= {finding.code for finding in result.findings}
