"""A ball that bounces on a stiff dash-pot stop comes to rest, and stays at rest."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import vibrokit as vk
from tests.layers import long, slow
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.symbolic.flow_kind import Flow

GRAVITY = 9.8
STARTS = np.array([[height, speed] for height in np.linspace(0.1, 10.0, 30) for speed in (0.0, -3.0, 5.0, -20.0)])


def ball(stiffness, damping, side, adhesive=False):
    """No spring, a constant force towards a stop at 0 of force k·depth + 2ζ√k·rate."""
    law = vk.CustomLaw("k*depth + c*rate", k=stiffness, c=2 * damping * math.sqrt(stiffness))
    return vk.Oscillator(
        natural_frequency=1.0, damping_ratio=0.0, spring=vk.LinearSpring(0.0),
        barriers=(vk.Barrier(law, 0.0, side, adhesive=adhesive),),
        excitations=(vk.Constant(GRAVITY if side == "right" else -GRAVITY),),
    )  # fmt: skip


@pytest.mark.parametrize("stepper", [vk.FreeFlight(1e-10), vk.Order8(1e-6), vk.Order8(1e-10)], ids=str)
@pytest.mark.parametrize(
    ("stiffness", "damping", "side", "adhesive"),
    [
        (1e4, 0.074355, "left", False),
        (1e6, 0.074355, "right", False),
        long(1e8, 0.074355, "left", False),
        slow(1e6, 0.3, "left", True),
        slow(1e6, 1.5, "right", False),
    ],
)
def test_ball_rests_at_the_depth_that_bears_its_weight(stepper, stiffness, damping, side, adhesive):
    """From 120 starts, after 100 s: the depth is g/k, in closed form."""
    sign = 1.0 if side == "right" else -1.0
    ended = run_ensemble(ball(stiffness, damping, side, adhesive), Flow.STATE, stepper, -sign * STARTS, 16)
    assert not ended.status.any()
    np.testing.assert_allclose(ended.states[:, 0], sign * GRAVITY / stiffness, rtol=1e-9)


@pytest.mark.parametrize("height", [10.0, 50.0])
def test_rebounds_fall_and_end(height):
    """Rigid limit: each rebound has e² of the height of the one before, e = 0.8, and all end at √(2h/g)(1+e)/(1−e)."""
    e, end = 0.8, math.sqrt(2 * height / GRAVITY) * 9.0
    path = ball(1e8, 0.074355, "left").trajectory((height, 0.0), duration=1.2 * end, samples=4096)
    tops = path.x[1:-1][(path.x[1:-1] > path.x[:-2]) & (path.x[1:-1] >= path.x[2:])]
    high = tops[tops > 0.05 * height]
    np.testing.assert_allclose(high[1:] / high[:-1], e**2, rtol=2e-3)
    assert high[0] / height == pytest.approx(e**2, rel=2e-3)
    assert path.t[path.x > 1e-4 * height][-1] < end
    np.testing.assert_allclose(path.x[path.t > 1.02 * end], -GRAVITY / 1e8, rtol=1e-6)


@pytest.mark.long
def test_structure_has_one_attractor_and_loses_no_start():
    structure = vk.find_structure(ball(1e6, 0.074355, "left"), rng=0)
    (rest,) = structure.attractors
    assert rest.kind == "equilibrium"
    assert rest.basin_fraction == 1.0
    np.testing.assert_allclose(rest.points, [[-GRAVITY / 1e6, 0.0]], rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize("gap", [slow(0.0), 0.1])
@pytest.mark.parametrize("left", ["dash", "hertz"])
@pytest.mark.parametrize("right", ["dash", "hertz"])
def test_motion_that_starts_at_rest_at_a_stop_goes_on_to_another(left, right, gap):
    """The first touch is at no speed, so that its first steps are short; those of later touches must not be."""
    laws = {"dash": vk.CustomLaw("k*depth + c*rate", k=30.0, c=1.0), "hertz": vk.Hertz(200.0)}
    osc = vk.Oscillator(
        natural_frequency=0.544, damping_ratio=0.3, spring=vk.LinearSpring(0.0),
        barriers=(vk.Barrier(laws[left], -gap, "left"), vk.Barrier(laws[right], 0.0, "right")),
        excitations=(vk.Harmonic(-0.55, 4.36, 2.764),),
    )  # fmt: skip

    def slope(t, y):
        x, v = y
        name, depth, rate, side = (right, x, v, 1.0) if x > 0 else (left, -gap - x, -v, -1.0)
        depth = max(depth, 0.0)
        push = 200.0 * depth**1.5 if name == "hertz" else max(30.0 * depth + rate, 0.0) if depth > 0 else 0.0
        return v, -2 * 0.3 * 0.544 * v - side * push - 0.55 * math.cos(4.36 * t + 2.764)

    known = solve_ivp(slope, (0.0, 6.0), (0.0, 0.0), method="DOP853", rtol=1e-10, atol=1e-13, max_step=2e-3)
    for tolerance in (1e-6, 1e-9, 1e-11):
        path = osc.trajectory((0.0, 0.0), duration=6.0, stepper=vk.Order8(tolerance))
        np.testing.assert_allclose([path.x[-1], path.v[-1]], known.y[:, -1], atol=1e-4)
