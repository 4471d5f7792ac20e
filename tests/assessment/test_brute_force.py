"""Answers of an assessment against simulated runs that share nothing with the package."""

import functools
import math

import numpy as np
import pytest
from scipy import stats

import vibrokit as vk
from tests.brute_force import STOP, WELL
from tests.layers import long
from vibrokit.assessment.assessment import Assessment

pytestmark = pytest.mark.slow

RUNS = [4000, long(100_000)]
LADDERS = {WELL: (0.11, 0.08, 0.06), STOP: (0.011, 0.008, 0.006)}
SURE = 3.0  # standard errors of the simulated runs, of which there are some twenty numbers


@functools.cache
def scene_and_structure(scene):
    linear, cubic, stiffness, position = scene.spring
    stops = (vk.Barrier(vk.Linear(stiffness), position, "right"),) if stiffness else ()
    osc = vk.Oscillator(
        natural_frequency=1.0, damping_ratio=scene.damping / 2, spring=vk.CubicSpring(linear, cubic), barriers=stops,
        excitations=(vk.Harmonic(scene.amplitude, scene.frequency), vk.Constant(scene.constant)),
        noise=vk.WhiteNoise(LADDERS[scene][1]),
    )  # fmt: skip
    return osc, vk.find_structure(osc, cells=(60, 60), starts=(8, 8), manifolds=False)


@functools.cache
def assessed(scene):
    """An assessment by rates alone, of all states of the well, and of the clear one before the stop."""
    osc, structure = scene_and_structure(scene)
    source = None if scene is WELL else label_near(structure, scene, 0)
    mfet = vk.MFET(intensities=LADDERS[scene], source=source, escapes=0).run(osc, structure)
    sgcm = vk.SGCM(intensities=LADDERS[scene], source=source, nodes=(120, 120)).run(osc, structure)
    return made(structure, {"mfet": mfet, "sgcm": sgcm})


def made(structure, results):
    scene = next(iter(results.values())).scene
    return Assessment(scene=scene, structure=structure, results=results, settings={"accuracy": 0.1})


def label_near(structure, scene, home):
    point = scene.attractors()[home]
    return min(structure.attractors, key=lambda one: np.linalg.norm(one.points[0, :2] - point)).label


def consistent(answer, value, error):
    return answer.lower - SURE * error <= value <= answer.upper + SURE * error


@pytest.mark.parametrize("runs", RUNS)
@pytest.mark.parametrize(
    ("scene", "intensity"), [(WELL, 0.09), (WELL, 0.08), (WELL, 0.07), long(STOP, 0.009), long(STOP, 0.007)]
)
def test_mean_times_and_probabilities_of_leaving(scene, intensity, runs):
    found, times = assessed(scene), scene.exits(0, intensity, runs, 700)
    source = label_near(found.structure, scene, 0)
    assert (times > 0).mean() > 0.999  # so that the mean of the others is no shorter
    mean = found.mean_time(source, intensity=intensity)
    seconds = scene.period * times[times > 0]
    assert mean.metastable
    assert consistent(mean, seconds.mean(), seconds.std() / math.sqrt(runs))
    for periods in (1, 2, 5, 10, 20, 40, 80, 160):
        share = ((times > 0) & (times <= periods)).mean()
        answer = found.probability_of_leaving(source, scene.period * periods, intensity=intensity)
        assert consistent(answer, share, math.sqrt(share * (1 - share) / runs)), periods
    late = found.probability_of_leaving(source, scene.period * 160, intensity=intensity)
    assert late.upper - late.lower < 0.25  # the interval still says something


@pytest.mark.parametrize("runs", RUNS)
@pytest.mark.parametrize("intensity", [0.1, 0.08])
def test_shares_of_time(intensity, runs):
    found, shares = assessed(WELL), WELL.shares(intensity, runs, 200)
    occupancy = found.occupancy(intensity=intensity)
    for home in (0, 1):
        one, error = occupancy[label_near(found.structure, WELL, home)], math.sqrt(shares.prod() / runs)
        assert float(one["lower"]) - SURE * error <= shares[home] <= float(one["upper"]) + SURE * error
        assert float(one["upper"] - one["lower"]) < 0.1


@pytest.mark.long
@pytest.mark.parametrize("runs", RUNS)
def test_intervals_hold_the_truth_as_often_as_they_claim(runs):
    """Forty estimates from 25 exits each: 95 % intervals hold the mean time, and the shares that follow."""
    osc, structure = scene_and_structure(WELL)
    intensity, seeds = 0.08, 40
    times, shares = WELL.exits(0, intensity, runs, 700), WELL.shares(intensity, runs, 200)
    source = label_near(structure, WELL, 0)
    held = np.zeros(2)
    for seed in range(seeds):
        mfet = vk.MFET(intensities=(intensity,), target_error=0.2, seed=seed, escapes=0, splitting=False)
        one = made(structure, {"mfet": mfet.run(osc, structure)})
        mean, share = one.mean_time(source), one.occupancy()[source]
        held += mean.lower <= WELL.period * times.mean() <= mean.upper, share["lower"] <= shares[0] <= share["upper"]
    least, most = stats.binom.ppf([0.001, 0.999], seeds, 0.95)
    assert (least <= held).all()
    assert (held <= most).all()
