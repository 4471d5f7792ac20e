"""Mean exit times against exact rates, against each other, against densities and against exact first passages."""

import dataclasses
import math

import numpy as np
import pytest
from scipy import integrate, stats

import vibrokit as vk
from tests.klein_kramers import double_well_rate
from tests.layers import long
from tests.scenes import Coloured, double_well, scene
from vibrokit.analyzers.checkpoint import Checkpoint
from vibrokit.analyzers.mfet.importance import from_distances
from vibrokit.analyzers.mfet.measurement import rate_around
from vibrokit.analyzers.mfet.splitting import SplittingRun
from vibrokit.analyzers.mfet.walk import Walk
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.results.codes import Code

pytestmark = pytest.mark.slow


def well(damping):
    return double_well(damping_ratio=damping, noise=vk.WhiteNoise(intensity=damping / 12))


def rate_at(osc, structure, ratio, **settings):
    """The rate out of one well at ΔU/D; ΔU = 4ζ times the barrier of 1/4."""
    given = {"source": 0, "intensities": (osc.damping_ratio / ratio,), "escapes": 0, **settings}
    found = vk.MFET(**given).run(osc, structure)
    (rate,) = found.rates
    return rate


@pytest.fixture(scope="module", params=[0.2, long(1.0)])
def scene_and_structure(request):
    osc = well(request.param)
    return osc, vk.find_structure(osc, cells=(40, 40), manifolds=False, rng=0)


def test_direct_rates_are_exact(scene_and_structure):
    osc, structure = scene_and_structure
    rate = rate_at(osc, structure, 6.0, splitting=False, target_error=0.02)
    expected = double_well_rate(osc.damping_ratio, rate.intensity)
    # The eigenvalue has no time to settle in the other well, which is two or three relaxations here.
    settling = 3.0 * osc.section_interval * math.exp(rate.log_value)
    assert abs(rate.log_value - expected) <= 3 * rate.log_error + settling


def test_rates_by_splitting_are_exact(scene_and_structure):
    osc, structure = scene_and_structure
    rate = rate_at(osc, structure, 25.0, splitting=True, target_error=0.2)
    assert rate.log_error < 0.25
    assert abs(rate.log_value - double_well_rate(osc.damping_ratio, rate.intensity)) <= 3 * rate.log_error


@pytest.mark.long
def test_direct_and_splitting_agree(scene_and_structure):
    osc, structure = scene_and_structure
    one, other = (rate_at(osc, structure, 7.0, splitting=way, target_error=0.05) for way in (False, True))
    assert [one.method, other.method] == ["direct", "splitting"]
    assert abs(one.log_value - other.log_value) <= 3 * math.hypot(one.log_error, other.log_error)


@pytest.mark.long
def test_the_choice_between_them_leaves_rates_unbiased():
    """Where chance decides between the methods, the mean of many rates is exact: luck in the choice is no evidence."""
    osc = well(0.2)
    structure = vk.find_structure(osc, cells=(40, 40), manifolds=False, rng=0)
    found = [rate_at(osc, structure, 7.5, target_error=0.2, seed=seed) for seed in range(60)]
    assert {rate.method for rate in found} == {"direct", "splitting"}
    ratios = np.exp([rate.log_value - double_well_rate(0.2, rate.intensity) for rate in found])
    assert abs(ratios.mean() - 1) <= 3 * ratios.std(ddof=1) / math.sqrt(len(ratios))


@pytest.mark.long
def test_intervals_of_splitting_cover_the_truth():
    """Of intervals of 95 %, each from 16 replicas, as many contain the rate as their number's error allows."""
    count = 60
    osc = well(0.2)
    structure = vk.find_structure(osc, cells=(40, 40), manifolds=False, rng=0)
    problem = ExitProblem(osc, structure, structure.attractors[0], vk.LeaveBasin())
    walks = [Walk(problem, 0.2 / 5.0, seed, vk.RK4(64)) for seed in range(count)]
    importance, estimates = dataclasses.replace(from_distances(walks[0]), depth=5.0), []
    for walk in walks:
        run = SplittingRun(walk, importance, 1e-3, 16, Checkpoint(None, {}).slot("one"))
        run.run()
        estimates.append(run.estimates)
    together = np.concatenate([one.log_values for one in estimates])
    truth = np.logaddexp.reduce(together) - math.log(len(together))  # of all, a tenth of one's error away
    rates = [rate_around(one.log_mean, one.error, len(one.log_values)) for one in estimates]
    covered = sum(rate.log_lower <= truth <= rate.log_upper for rate in rates)
    assert covered >= 0.95 * count - 3 * math.sqrt(count * 0.95 * 0.05)


# ln of the mean time core to core in periods, from 50 000 to 200 000 trajectories by RK4(512), in a program of its own
SIMULATED = {1e-4: (3.638, 0.004), 5e-5: (4.304, 0.004), 2e-5: (6.492, 0.007), 1e-5: (10.70, 0.05)}


@pytest.mark.long
def test_times_of_the_paper_s_scene_are_those_of_simulated_trajectories():
    osc = vk.load_scene("hertz-0.570")
    structure = vk.find_structure(osc, cells=(100, 100), rng=0)
    found = vk.MFET(source="clear", intensities=tuple(SIMULATED), escapes=0).run(osc, structure)
    assert [rate.method for rate in found.rates] == ["direct", "direct", "direct", "splitting"]
    for rate in found.rates:
        expected, error = SIMULATED[rate.intensity]
        mean = -rate.log_value - math.log(osc.section_interval)
        assert abs(mean - expected) <= 3 * math.hypot(rate.log_error, error)
    assert Code.NOT_METASTABLE in {finding.code for finding in found.findings}
    (energy,) = found.energies  # from the two intensities at which the state is metastable
    assert energy.lower <= 7.90522e-5 <= energy.upper  # certified


def first_contact(osc, **settings):
    """The rate of first contact, and the structure's only attractor is left from its orbit."""
    structure = vk.find_structure(osc, cells=(10, 10), manifolds=False, rng=0)
    given = {"target_error": 0.03, "escapes": 0, "intensities": (osc.noise.intensity,), **settings}
    (rate,) = vk.MFET(exit=vk.FirstContact(), from_orbit=True, splitting=False, **given).run(osc, structure).rates
    return rate


FREE = np.array([[0.0, 1.0], [-1.0, -0.1]])  # x″ + 0.1 x′ + x
CONTACTS = {
    "soft stop": (FREE, {"barriers": (vk.Barrier(vk.Linear(100.0), 0.8, "right"),)}),
    "two rigid stops": (
        FREE, {"barriers": (vk.Barrier(vk.Hertz(1e8), 0.8, "right"), vk.Barrier(vk.Linear(1e6), -0.8, "left"))},
    ),
    "forced, rigid stop": (
        FREE, {
            "barriers": (vk.Barrier(vk.Linear(1e6), -1.0, "left"),), "excitations": (vk.Harmonic(0.15, 0.7),),
        },
    ),
    "coloured noise, rigid stop": (
        np.array([[0.0, 1.0, 0.0], [-1.0, -0.1, 1.0], [0.0, 0.0, -1.0]]),
        {"barriers": (vk.Barrier(vk.Linear(1e6), 0.6, "right"),), "noise": Coloured(0.02, 1.0)},
    ),
    "strong damping, rigid stop": (
        np.array([[0.0, 1.0], [-1.0, -6.0]]),
        {"barriers": (vk.Barrier(vk.Linear(1e6), 0.09, "right"),), "damping_ratio": 3.0},
    ),
}  # fmt: skip
BRIEF = ("two rigid stops", "strong damping, rigid stop")


@pytest.mark.parametrize(
    ("drift", "more"),
    [pytest.param(*made, id=name, marks=[pytest.mark.long] * (name not in BRIEF)) for name, made in CONTACTS.items()],
)
def test_first_contact_of_a_linear_scene_is_that_of_the_exact_process(drift, more):
    """Samples of the exact linear process, tested 512 times in 2π: what happens in the stop does not matter."""
    osc = scene(**{"damping_ratio": 0.05, "noise": vk.WhiteNoise(intensity=0.02)} | more)
    rate = first_contact(osc)
    log_rate, error = exact_first_passages(osc, drift, 1000)
    assert abs(rate.log_value - log_rate) <= 3 * math.hypot(rate.log_error, error)


@pytest.mark.long
def test_first_contact_with_a_stop_that_is_shorter_than_the_time_between_tests():
    """50 Hz, Q = 10, 0.04 g²/Hz, a stop of 5 kHz at three standard deviations: 0.40(1) s⁻¹, below Rice's 0.5554."""
    frequency, intensity = 2 * math.pi * 50, 0.04 * 9.80665**2 / 2
    level = 3 * math.sqrt(intensity / (4 * 0.05 * frequency**3))
    osc = vk.Oscillator(
        natural_frequency=frequency, damping_ratio=0.05, noise=vk.WhiteNoise(intensity),
        barriers=(vk.Barrier(vk.Linear(1e9), level, "right"),),
    )  # fmt: skip
    rate = first_contact(osc)
    assert rate.value == pytest.approx(0.40, abs=3 * math.hypot(0.01, 0.40 * rate.log_error))
    assert rate.value < 0.5554


class TooFast(vk.LeaveRegion):
    """A velocity above a limit."""

    limit: float = 0.4

    def bounds(self, osc):
        return np.array([[-math.inf, math.inf], [-math.inf, self.limit]])


def test_noise_may_pass_a_velocity_within_a_step():
    """Nearly free: v is an Ornstein–Uhlenbeck process of rate 10, of which the time to 2.5 deviations is known."""
    osc = scene(damping_ratio=5.0, noise=vk.WhiteNoise(intensity=0.2), spring=vk.CubicSpring(linear=1e-4, cubic=1e-4))
    structure = vk.find_structure(osc, region=((-1, 1), (-1, 1)), cells=(10, 10), manifolds=False, rng=0)
    found = vk.MFET(exit=TooFast(0.25), target_error=0.02, escapes=0, intensities=(0.2,), splitting=False)
    (rate,) = found.run(osc, structure).rates
    expected = integrate.quad(lambda u: stats.norm.cdf(u) * math.exp(u**2 / 2), 0, 2.5)[0] * math.sqrt(2 * math.pi) / 10
    assert abs(-rate.log_value - math.log(expected)) <= 3 * rate.log_error


def exact_first_passages(osc, drift, count):
    """ln of the rate, and its error, at which a linear scene at its forced orbit first exceeds a stop.

    Steps of the free process are exact in law; white noise drives its last component. Nine in ten are waited for, and
    the others count with their time.
    """
    from scipy.linalg import expm, solve_continuous_lyapunov

    step, size = 2 * math.pi / 512, len(drift)
    strength = np.zeros((size, size))
    strength[-1, -1] = osc.noise.intensity
    stationary = solve_continuous_lyapunov(drift, -strength)
    carried = expm(drift * step)
    root = np.linalg.cholesky(stationary - carried @ stationary @ carried.T)
    rng, states = np.random.default_rng(17), np.zeros((count, size))
    stops = {barrier.side: barrier.position for barrier in osc.barriers}
    low, high = stops.get("left", -math.inf), stops.get("right", math.inf)
    time, at_risk, left = 0.0, 0.0, 0
    while left < 0.9 * count:
        time += step
        at_risk += step * len(states)
        states = states @ carried.T + rng.standard_normal(states.shape) @ root.T
        x = states[:, 0] + sum(
            (f.amplitude * np.exp(1j * f.frequency * time) / (1 - f.frequency**2 + 0.1j * f.frequency)).real
            for f in osc.excitations
        )
        out = (x >= high) | (x <= low)
        left += int(out.sum())
        states = states[~out]
    return math.log(left / at_risk), left**-0.5
