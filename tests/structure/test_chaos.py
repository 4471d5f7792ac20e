import numpy as np
import pytest

import vibrokit as vk
from tests.layers import long
from tests.scenes import Coloured, scene
from vibrokit.results.basins import ESCAPED
from vibrokit.structure.attractors.wandering import (
    LyapunovEstimate,
    fit_decay,
    follow,
    kind_of,
    lyapunov_exponent,
    separate,
    standard_error,
    watch,
)
from vibrokit.structure.orbits import arrival_at

pytestmark = pytest.mark.slow

CLEAR = np.array([[0.448438, 0.001891]])  # the attractors of hertz-0.525 that repeat
HAMMERING = np.array([[0.096614, -0.027017], [0.135228, -0.025599], [0.096896, -0.026171], [0.136309, -0.026357]])


def starts(count, low, high, seed=0):
    return np.random.default_rng(seed).uniform(low, high, (count, 2))


def cubic(parameter, count, start):
    """A sample of x → a x − x³: two chaotic attractors, x > 0 and x < 0, merge at a = 3√3/2 = 2.598."""
    x, sample = start, np.zeros((count, 2))
    for index in range(-1000, count):
        x = parameter * x - x**3
        if index >= 0:
            sample[index, 0] = x
    return sample


# --- Lyapunov exponents ---


@pytest.mark.parametrize("damping_ratio", [0.05, 2.0])
def test_the_exponent_of_a_linear_oscillator(damping_ratio):
    osc = scene(
        natural_frequency=2.0, damping_ratio=damping_ratio, excitations=(vk.Harmonic(amplitude=1.0, frequency=1.3),)
    )
    found = lyapunov_exponent(osc, starts(8, -1, 1), vk.RK4(256), periods=400, skipped=50)
    exact = -2.0 * (damping_ratio - np.sqrt(max(damping_ratio**2 - 1, 0)))
    # Turning, the length of a vector swings by the condition of the eigenvectors, and no more.
    vectors = np.linalg.eig(np.array([[0.0, 1.0], [-4.0, -4.0 * damping_ratio]]))[1]
    assert abs(found.value - exact) < np.log(np.linalg.cond(vectors)) / (400 * found.interval)
    assert abs(found.value - exact) < 3 * found.error + 1e-8
    assert kind_of(found) is None


def test_the_exponent_of_three_states():
    osc = scene(
        damping_ratio=0.2,
        excitations=(vk.Harmonic(amplitude=1.0, frequency=1.3),),
        noise=Coloured(intensity=0.0, rate=0.05),
    )
    found = lyapunov_exponent(osc, np.zeros((2, 3)), vk.RK4(256), periods=200, skipped=50)
    assert found.value == pytest.approx(-0.05, abs=1e-6)  # the slowest of −0.2 and −0.05


def test_the_exponent_of_a_chaotic_double_well_is_that_of_an_independent_integration():
    # x″ + 0.3 x′ − x + x³ = 0.5 cos 1.2t, the textbook's chaotic Duffing oscillator
    osc = scene(
        damping_ratio=0.15,
        spring=vk.CubicSpring(linear=-1.0, cubic=1.0),
        excitations=(vk.Harmonic(amplitude=0.5, frequency=1.2),),
    )
    found = lyapunov_exponent(osc, starts(64, -1, 1), vk.RK4(256), periods=400, skipped=100)
    value, error = shadowed_exponent(starts(64, -1, 1, seed=1), periods=300, skipped=100, steps=100)
    assert kind_of(found) == "chaotic"
    assert 0.5 < found.error / error < 2.0
    assert abs(found.value - value) < 3 * np.hypot(found.error, error)


def shadowed_exponent(states, periods, skipped, steps, distance=1e-7):
    """Exponent of that oscillator by the distance of a second trajectory, in plain NumPy."""
    period = 2 * np.pi / 1.2
    h = period / steps

    def rates(t, x, v):
        return v, 0.5 * np.cos(1.2 * t) - 0.3 * v + x - x**3

    def stepped(t, x, v):
        a = rates(t, x, v)
        b = rates(t + h / 2, x + h / 2 * a[0], v + h / 2 * a[1])
        c = rates(t + h / 2, x + h / 2 * b[0], v + h / 2 * b[1])
        d = rates(t + h, x + h * c[0], v + h * c[1])
        return x + h / 6 * (a[0] + 2 * b[0] + 2 * c[0] + d[0]), v + h / 6 * (a[1] + 2 * b[1] + 2 * c[1] + d[1])

    x, v = np.stack([states[:, 0], states[:, 0] + distance]), np.stack([states[:, 1], states[:, 1]])
    growth = np.zeros(len(states))
    for number in range(skipped + periods):
        for step in range(steps):
            x, v = stepped(step * h, x, v)
        apart = np.hypot(x[1] - x[0], v[1] - v[0])
        growth += np.log(apart / distance) * (number >= skipped)
        x[1], v[1] = x[0] + (x[1] - x[0]) * distance / apart, v[0] + (v[1] - v[0]) * distance / apart
    exponents = growth / (periods * period)
    assert exponents.min() > 0  # none of the starts came to an orbit
    return exponents.mean(), exponents.std(ddof=1) / np.sqrt(len(states))


def test_motion_on_an_invariant_circle_is_quasiperiodic():
    osc = scene(
        damping_ratio=0.0,
        spring=vk.CustomSpring("x + mu*(x**2 - 1)*v", mu=0.2),
        excitations=(vk.Harmonic(amplitude=0.3, frequency=1.618),),
    )
    states = osc.section_map(starts(4, -1, 1), 300, stepper=vk.RK4(256))
    for periods in (200, 1000):
        found = lyapunov_exponent(osc, states, vk.RK4(256), periods=periods)
        assert kind_of(found) == "quasiperiodic", found
    sample = [states]
    for _ in range(1500):
        sample.append(osc.section_map(sample[-1], stepper=vk.RK4(256)))
    samples = list(np.array(sample).transpose(1, 0, 2))
    assert len(separate(samples, 0.1)) == 1


@pytest.mark.parametrize(
    ("value", "error", "kind"),
    [
        (0.05, 0.01, "chaotic"),
        (0.05, 0.02, "quasiperiodic"),  # not significant
        (np.log(11) / 1000, 1e-9, "quasiperiodic"),  # shear on a circle: log((100 + 1000)/100) of growth
        (0.0, 1e-3, "quasiperiodic"),
        (-0.005, 1e-3, None),
        (-0.002, 1e-3, "quasiperiodic"),
        (-0.5, 1e-3, None),
    ],
)
def test_kinds(value, error, kind):
    assert kind_of(LyapunovEstimate(value, error, periods=1000, interval=1.0)) == kind


@pytest.mark.parametrize(("periods", "count", "copies"), [(1000, 1, 1), (200, 40, 1), (1000, 4, 8)])
def test_the_standard_error_is_honest(periods, count, copies):
    # Rates correlated over some ten periods, from independent starts or from copies of the same.
    rng = np.random.default_rng(0)
    misses = []
    for _ in range(200):
        rates = np.empty((periods, count))
        state = rng.normal(size=count)
        for row in rates:
            state = 0.9 * state + np.sqrt(1 - 0.81) * rng.normal(size=count)
            row[:] = state
        rates = np.tile(rates, (1, copies))
        misses.append(rates.mean() / standard_error(rates))
    assert 0.7 < np.sqrt(np.mean(np.square(misses))) < 1.3


# --- survival ---


def decayed(lifetime, count, periods, rng):
    times = np.ceil(rng.exponential(lifetime, count)).astype(np.int64)
    return np.where(times <= periods, times, -1)


@pytest.mark.parametrize(
    ("lifetime", "count", "periods", "immortal"),
    [(450, 300, 20000, 0), (450, 300, 20000, 100), (5000, 400, 10000, 0), (5000, 400, 10000, 100), (50, 20, 20000, 5)],
)
def test_the_lifetime_is_of_those_that_settle(lifetime, count, periods, immortal):
    rng = np.random.default_rng(0)
    misses = []
    for _ in range(100):
        settled_after = np.concatenate([decayed(lifetime, count, periods, rng), np.full(immortal, -1)])
        fitted, error = fit_decay(settled_after, periods)
        misses.append(np.log(fitted / lifetime) * fitted / error)  # few times: skew
    assert 0.7 < np.sqrt(np.mean(np.square(misses))) < 1.4


def test_starts_that_converge_slowly_do_not_count():
    rng = np.random.default_rng(0)
    slow = rng.integers(30, 60, 200)
    late = decayed(500, 300, 20000, rng)
    lifetime, error = fit_decay(np.concatenate([slow, np.where(late > 0, late + 40, -1)]), 20000)
    assert abs(lifetime - 500) < 3 * error


def test_no_decay_is_seen_where_none_settled():
    for settled_after in (np.full(10, -1), np.array([], dtype=np.int64)):
        assert fit_decay(settled_after, 1000) == (np.inf, np.inf)


def arrival(orbits):
    return arrival_at(dict(enumerate(orbits)), np.array([1e-3, 1e-3]))


def test_watching_an_orbit_and_what_runs_away():
    osc = vk.load_scene("duffing").replace({"spring.cubic": -0.3, "excitations.0.amplitude": 0.1})
    orbit = osc.section_map([[0.0, 0.0]], 400)
    states = np.array([[0.0, 0.0], [9.0, 9.0], [0.1, 0.0]])
    _, _, labels = follow(osc, states, arrival([orbit]), 300, vk.RK4(256))
    np.testing.assert_array_equal(labels, [0, ESCAPED, 0])
    survival, left = watch(osc, states, arrival([orbit]), vk.RK4(256), longest=300)
    assert (survival.survivors, len(left)) == (0, 0)
    assert (survival.settled_after >= 0).all()
    survival, left = watch(osc, states[::2], arrival([]), vk.RK4(256), longest=30)
    np.testing.assert_allclose(left, osc.section_map(states[::2], 30, stepper=vk.RK4(256)))
    assert str(survival) == "2 of 2 starts had not settled after 30 periods (RK4(steps=256)), and none ever settled"


def test_a_watch_ends_when_the_survivors_have_gone_on_for_long_enough():
    """One start of four settles after s periods; the others are on an orbit that is not known."""
    osc = vk.load_scene("double-well")
    left, right = (osc.section_map([start], 400, stepper=vk.RK4(256)) for start in ([-1.0, 0.0], [1.0, 0.0]))
    states = np.concatenate([[[1.4, 0.0]], np.repeat(left, 3, axis=0)])
    survival, survivors = watch(osc, states, arrival([right]), vk.RK4(256), longest=10_000, exposure=1200)
    (settled,) = survival.settled_after[:1]
    assert 1 < settled < 300
    np.testing.assert_array_equal(survival.settled_after[1:], -1)
    assert survival.periods == settled + 400  # three survivors, 1200 periods together
    np.testing.assert_allclose(survivors, np.repeat(left, 3, axis=0), atol=1e-8)
    survival, _ = watch(osc, states, arrival([right]), vk.RK4(256), longest=350, exposure=1200)
    assert survival.periods == 350


# --- hertz-0.525: a chaotic attractor beside a chaotic transient ---


@pytest.fixture(scope="module")
def hammered():
    return vk.load_scene("hertz-0.525"), starts(80, [0.05, -0.12], [0.2, 0.05])


@pytest.mark.parametrize("steps", [long(512), 1024])
def test_the_chaotic_attractor_lasts(hammered, steps):
    osc, states = hammered
    stepper = vk.RK4(steps)
    survival, left = watch(osc, states, arrival([CLEAR, HAMMERING]), stepper, longest=3000)
    assert survival.survivors >= 10
    assert 250 < survival.lifetime < 900  # some 450 are known
    found = lyapunov_exponent(osc, left, stepper, periods=600)
    assert kind_of(found) == "chaotic"
    sample = [left[:4]]
    for _ in range(1000):
        sample.append(osc.section_map(sample[-1], stepper=stepper))
    samples = list(np.array(sample).transpose(1, 0, 2))
    assert len(separate(samples, 1e-3)) == 1


def test_too_coarse_a_stepper_loses_it(hammered):
    osc, states = hammered
    survival, _ = watch(osc, states, arrival([CLEAR, HAMMERING]), vk.RK4(256), longest=30000)
    assert survival.survivors == 0


@pytest.mark.long
def test_exact_flight_and_fixed_steps_agree_on_its_exponent(hammered):
    osc, states = hammered
    stepper = vk.RK4(2048)
    _, left = watch(osc, states, arrival([CLEAR, HAMMERING]), stepper, longest=3000)
    fixed = lyapunov_exponent(osc, left, stepper, periods=300)
    exact = lyapunov_exponent(osc, left[:8], vk.FreeFlight(1e-9), periods=500)
    assert kind_of(fixed) == kind_of(exact) == "chaotic"
    assert abs(fixed.value - exact.value) < 3 * np.hypot(fixed.error, exact.error)


# --- groups ---


@pytest.mark.parametrize("size", [1.0, 1e6])  # of the motion, in tolerances of 0.01
@pytest.mark.parametrize(("parameter", "groups"), [(2.5, [[0, 2, 3], [1, 4]]), (2.7, [[0, 1, 2, 3, 4]])])
def test_two_chaotic_attractors_are_told_apart(parameter, groups, size):
    samples = [cubic(parameter, 2000, start) for start in (0.31, -0.29, 0.5, 0.72, -0.1)]
    if parameter < 2.598:  # a positive start may lead to the negative attractor
        signs = (1, -1, 1, 1, -1)
        samples = [sample * sign * np.sign(sample[0, 0]) for sample, sign in zip(samples, signs, strict=True)]
    found = separate([size * sample for sample in samples], 0.01)
    assert [list(members) for members in found] == groups
