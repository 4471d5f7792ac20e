"""Numbers of the pages of questions that take too long for a doctest."""

import numpy as np
import pytest

import vibrokit as vk
from tests.tutorials.test_readme import DOCS
from vibrokit.comparison.sensitivities import sensitivities

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def lever():
    return vk.load_scene(DOCS / "questions/lever.toml")


@pytest.fixture(scope="module")
def structure(lever):
    return vk.find_structure(lever, cells=(60, 60), manifolds=False, rng=0)


@pytest.fixture(scope="module")
def exit_of_hammering(lever, structure):
    return vk.LeastAction(source="hammering").run(lever, structure).energy("hammering", "clear")


def effect_of_stops(energy, lever):
    """By how many per cent 1 % more stiffness of both stops changes ΔU."""
    tied = {"stops": ["barriers.0.law.stiffness", "barriers.1.law.stiffness"]}
    found = sensitivities(energy, lever.parameters, lever.noise.intensity, tied=tied)
    return next(one.energy for one in found if one.parameter == "stops")


def test_stiffer_stops_lower_the_barrier_of_the_hammering_state(lever, structure, exit_of_hammering):
    """which-dimension: 0.16 % for the certified path, 0.9 % for the path of a small search, which costs 6 % more."""
    assert exit_of_hammering.bound is vk.Bound.CERTIFIED
    assert effect_of_stops(exit_of_hammering, lever) == pytest.approx(-0.16, abs=0.01)
    small = vk.LeastAction(source="hammering", graph=None, shooting=vk.Shooting(points=500))
    dearer = small.run(lever, structure).energy("hammering", "clear")
    assert dearer.value / exit_of_hammering.value == pytest.approx(1.06, abs=0.01)
    assert effect_of_stops(dearer, lever) == pytest.approx(-0.9, abs=0.05)


def test_band_of_the_noise_force_on_the_way_out_of_the_hammering_state(exit_of_hammering):
    """spectrum-to-d: the largest part of the action is at 79 Hz, and 99 % of it lie below 314 Hz."""
    path = exit_of_hammering.path
    times = np.linspace(path.t[0], path.t[-1], 2**16)
    part = np.abs(np.fft.rfft(np.interp(times, path.t, path.p[:, 1]))) ** 2
    frequencies = np.fft.rfftfreq(times.size, times[1] - times[0])
    below = np.cumsum(part) / part.sum()
    assert frequencies[part.argmax()] == pytest.approx(79, abs=2)
    assert frequencies[np.searchsorted(below, 0.99)] == pytest.approx(314, abs=2)


def test_the_mean_time_of_the_clear_state_without_a_time_limit(lever):
    """how-long: 5.4 hours (4.02 to 7.25)."""
    found = vk.assess(lever, source="clear", time_limit=None, rng=0)
    assert found.reconciliation.agreed
    time = found.mean_time("clear")
    assert time.lower < 5.4 * 3600 < time.upper
    assert 4.02 * 3600 < time.value < 7.25 * 3600
