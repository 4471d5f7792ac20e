"""Stops from soft to rigid, hit squarely and grazed: after whole exact periods the state is back where it was."""

import numpy as np
import pytest

import vibrokit as vk
from tests.extremes.exact import exact_period, rounding_after
from tests.layers import long
from tests.scenes import double_well, scene
from vibrokit.structure.linear_map import gaussian_map

pytestmark = pytest.mark.slow

CYCLES = 10
STEPPERS = [vk.FreeFlight(tolerance=1e-12), vk.Order8(tolerance=1e-12)]


@pytest.mark.parametrize("stepper", STEPPERS, ids=lambda s: s.name)
@pytest.mark.parametrize("law", ["hertz", "linear"])
@pytest.mark.parametrize("stiffness", [1.0, *map(long, (1e2, 1e4)), 1e6, *map(long, (1e8, 1e10)), 1e12])
@pytest.mark.parametrize("excess", [1.0, long(1e-2), 1e-4, long(1e-6), 1e-8], ids=lambda e: f"excess{e:g}")
def test_back_after_whole_periods(stepper, law, stiffness, excess):
    check_periods(stepper, law, stiffness, excess)


@pytest.mark.parametrize("law", ["hertz", "linear"])
@pytest.mark.parametrize("stiffness", [1.0, 1e4, 1e8, 1e12])
def test_a_visit_of_a_ten_billionth_is_not_missed(law, stiffness):
    """The visit is far shorter than any step; only a tolerance below its depth can tell what it does."""
    check_periods(vk.FreeFlight(tolerance=1e-14), law, stiffness, 1e-10)


def check_periods(stepper, law, stiffness, excess):
    place = 0.3
    speed = place * (1 + excess)
    make, power = {"hertz": (vk.Hertz, 1.5), "linear": (vk.Linear, 1.0)}[law]
    osc = scene(vk.Barrier(make(stiffness), place, "right"), damping_ratio=0.0)
    period = exact_period(stiffness, power, place, speed)
    path = osc.trajectory([0.0, speed], duration=CYCLES * period, samples=1, stepper=stepper)
    allowed = max(1e-8, rounding_after(CYCLES, stiffness, power, place, speed))
    np.testing.assert_allclose(path.states[-1], [0.0, speed], rtol=0, atol=allowed)


@pytest.mark.parametrize("stepper", STEPPERS, ids=lambda s: s.name)
@pytest.mark.parametrize("stiffness", [1.0, 1e6, 1e12])
def test_zero_gap(stepper, stiffness):
    """Both stops at 0: a mass that is always in one of them."""
    osc = scene(
        vk.Barrier(vk.Hertz(stiffness), 0.0, "right"), vk.Barrier(vk.Hertz(stiffness), 0.0, "left"), damping_ratio=0.0
    )
    half = exact_period(stiffness, 1.5, 0.0, 0.8) - np.pi  # the right half; the left one is its mirror image
    path = osc.trajectory([0.0, 0.8], duration=CYCLES * 2 * half, samples=1, stepper=stepper)
    np.testing.assert_allclose(path.states[-1], [0.0, 0.8], rtol=0, atol=1e-8)


def test_a_rest_that_touches_a_stop_with_a_rate_too_small_to_move():
    """At x = 1 all forces are 0, and the rounding error of a rest may be a positive velocity."""
    stops = (vk.Barrier(vk.Hertz(1e3), 1.0, "right"),)
    osc = double_well(damping_ratio=0.1, barriers=stops, noise=vk.WhiteNoise(intensity=1e-2))
    rates = np.array([0.0, 1e-21, 1e-18])
    found = gaussian_map(osc, np.stack([np.ones(3), rates], axis=1), vk.Order8(1e-10))
    assert np.abs(found.images - [1.0, 0.0]).max() < 1e-15
    np.testing.assert_allclose(found.derivatives, found.derivatives[:1].repeat(3, axis=0), rtol=1e-9)
    np.testing.assert_allclose(found.covariances, found.covariances[:1].repeat(3, axis=0), rtol=1e-9)
