"""Mean exit times against Kramers' formula, against each other, against densities and against exact first passages."""

import dataclasses
import math

import numpy as np
import pytest

import vibrokit as vk
from tests.physics.test_densities import kramers_rate
from tests.scenes import scene
from vibrokit.analyzers.checkpoint import Checkpoint
from vibrokit.analyzers.mfet.estimates import rate_around
from vibrokit.analyzers.mfet.importance import from_distances
from vibrokit.analyzers.mfet.splitting import SplittingRun
from vibrokit.analyzers.mfet.walk import Walk
from vibrokit.analyzers.neighbourhoods import covariances_of
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.results.codes import Code

pytestmark = pytest.mark.slow


def well(damping):
    return scene(
        damping_ratio=damping,
        spring=vk.CubicSpring(linear=-1.0, cubic=1.0),
        noise=vk.WhiteNoise(intensity=damping / 12),
    )


def rate_at(osc, structure, ratio, **settings):
    """The rate out of one well at ΔU/D; ΔU = 4ζ times the barrier of 1/4."""
    given = {"source": 0, "intensities": (osc.damping_ratio / ratio,), "escapes": 0, **settings}
    found = vk.MFET(**given).run(osc, structure)
    (rate,) = found.rates
    return rate


@pytest.fixture(scope="module", params=[0.2, pytest.param(1.0, marks=pytest.mark.long)])
def scene_and_structure(request):
    osc = well(request.param)
    return osc, vk.find_structure(osc, cells=(40, 40), manifolds=False, rng=0)


def test_direct_rates_are_those_of_kramers(scene_and_structure):
    osc, structure = scene_and_structure
    rate = rate_at(osc, structure, 6.0, splitting=False, target_error=0.02)
    expected, formula_error = kramers_rate(osc.damping_ratio, rate.intensity)
    # The formula has no time to settle in the other well, which is two or three relaxations here.
    settling = 3.0 * osc.section_interval * math.exp(rate.log_value)
    assert abs(rate.log_value - expected) <= 3 * rate.log_error + formula_error + settling


def test_rates_by_splitting_are_those_of_kramers(scene_and_structure):
    osc, structure = scene_and_structure
    rate = rate_at(osc, structure, 30.0, splitting=True, target_error=0.2)
    expected, formula_error = kramers_rate(osc.damping_ratio, rate.intensity)
    assert rate.log_error < 0.25
    assert abs(rate.log_value - expected) <= 3 * rate.log_error + formula_error + 0.01


def test_direct_and_splitting_agree(scene_and_structure):
    osc, structure = scene_and_structure
    one, other = (rate_at(osc, structure, 7.0, splitting=way, target_error=0.05) for way in (False, True))
    assert [one.method, other.method] == ["direct", "splitting"]
    assert abs(one.log_value - other.log_value) <= 3 * math.hypot(one.log_error, other.log_error)


@pytest.mark.long
def test_intervals_of_splitting_cover_the_truth():
    """Of intervals of 95 %, each from 16 replicas, as many contain the rate as their number's error allows."""
    count = 60
    osc = well(0.2)
    structure = vk.find_structure(osc, cells=(40, 40), manifolds=False, rng=0)
    problem = ExitProblem(osc, structure, structure.attractors[0], vk.LeaveBasin())
    covariances = {a.label: covariances_of(problem, a) for a in structure.attractors}
    walks = [Walk(problem, 0.2 / 5.0, seed, vk.RK4(64), covariances) for seed in range(count)]
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


def test_first_contact_of_a_linear_scene_is_that_of_the_exact_process():
    """Samples of the exact linear process, tested 512 times in a period with Brownian bridges left out."""
    osc = scene(
        damping_ratio=0.05,
        barriers=(vk.Barrier(vk.Linear(100.0), 0.8, "right"),),
        noise=vk.WhiteNoise(intensity=0.02),
    )
    structure = vk.find_structure(osc, region=((-2, 1.2), (-2, 2)), cells=(40, 40), manifolds=False, rng=0)
    found = vk.MFET(
        source=0, exit=vk.FirstContact(), from_orbit=True, target_error=0.025, escapes=0, intensities=(0.02,)
    ).run(osc, structure)
    (rate,) = found.rates
    times = exact_first_passages(0.05, 0.02, 0.8, 2000)
    spread = math.hypot(rate.log_error, times.std() / times.mean() / math.sqrt(len(times)))
    assert abs(-rate.log_value - math.log(times.mean())) <= 3 * spread


def exact_first_passages(damping, intensity, level, count):
    """Times at which x″ + 2ζ x′ + x = √D ξ, from rest, first exceeds a level; steps are exact in law."""
    from scipy.linalg import expm, solve_continuous_lyapunov

    step = 2 * math.pi / 512
    drift = np.array([[0.0, 1.0], [-1.0, -2 * damping]])
    stationary = solve_continuous_lyapunov(drift, -np.diag([0.0, intensity]))
    carried = expm(drift * step)
    root = np.linalg.cholesky(stationary - carried @ stationary @ carried.T)
    rng, states = np.random.default_rng(17), np.zeros((count, 2))
    times, alive = np.zeros(count), np.arange(count)
    for number in range(1, 10**7):
        states = states @ carried.T + rng.standard_normal((len(states), 2)) @ root.T
        out = states[:, 0] >= level
        times[alive[out]] = number * step
        alive, states = alive[~out], states[~out]
        if not len(alive):
            return times
    raise AssertionError("some never exceed the level")
