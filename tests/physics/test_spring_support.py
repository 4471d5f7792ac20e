"""A support that moves spring and damper while the stops are fixed in space."""

import math

import numpy as np
import pytest
import sympy
from scipy.integrate import solve_ivp

import vibrokit as vk
from tests.scenes import scene
from vibrokit.assessment.plausibility import Measure
from vibrokit.errors import DerivationError
from vibrokit.parts.functions import cos, sin
from vibrokit.structure.along_x import turn_of

A, W, PHASE = 0.3, 0.8, 0.4
MOVED = vk.SpringSupportMotion(amplitude=A, frequency=W, phase=PHASE)


def place(t):
    return A * math.cos(W * t + PHASE)


def speed(t):
    return -A * W * math.sin(W * t + PHASE)


@pytest.mark.parametrize("stepper", [vk.FreeFlight(), vk.Order8(1e-12), vk.RK4(4096)], ids=lambda one: one.name)
def test_without_stops_both_coordinates_tell_the_same_motion(stepper):
    absolute = scene(damping_ratio=0.1, excitations=(MOVED,))
    relative = scene(damping_ratio=0.1, excitations=(vk.SupportMotion(amplitude=A, frequency=W, phase=PHASE),))
    start = np.array([0.2, -0.1])
    foot = np.array([[place(t), speed(t)] for t in absolute.period * np.arange(4)])
    one = absolute.trajectory(start, periods=3, samples=1, stepper=stepper).states
    other = relative.trajectory(start - foot[0], periods=3, samples=1, stepper=stepper).states
    np.testing.assert_allclose(one, other + foot, rtol=0, atol=1e-9)


@pytest.mark.parametrize("stepper", [vk.Order8(1e-12), vk.RK4(4096), vk.RK8(512)], ids=lambda one: one.name)
def test_any_smooth_spring_is_carried(stepper):
    """Friction is not: it acts on the absolute velocity."""
    friction = vk.DryFriction(magnitude=0.05, width=0.5)
    osc = scene(damping_ratio=0.1, spring=vk.CustomSpring("sin(x) + x**3"), friction=friction, excitations=(MOVED,))

    def rate(t, state):
        x, v = state
        bent, sliding = x - place(t), v - speed(t)
        return v, -0.2 * sliding - math.sin(bent) - bent**3 - 0.05 * math.tanh(v / 0.5)

    wanted = solve_ivp(rate, (0, 2 * osc.period), [0.5, 0.2], method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
    found = osc.trajectory([0.5, 0.2], periods=2, stepper=stepper).states[-1]
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-8)


def test_a_stop_is_fixed_in_space():
    """Against SciPy, which integrates from touch to release."""
    stiffness, position = 80.0, 0.25
    stop = vk.Barrier(vk.Linear(stiffness), position, "right")
    osc = scene(stop, damping_ratio=0.1, excitations=(MOVED,))

    def rate(t, state, stiffness):
        x, v = state
        return v, -0.2 * (v - speed(t)) - (x - place(t)) - stiffness * (x - position)

    def at_stop(t, state, stiffness):
        return state[0] - position

    at_stop.terminal = True
    end, time, state, inside, touches = 4 * osc.period, 0.0, np.array([0.0, 0.3]), False, 0
    while time < end:
        at_stop.direction = -1.0 if inside else 1.0
        more = {"events": at_stop, "args": (stiffness if inside else 0.0,), "rtol": 1e-12, "atol": 1e-13}
        piece = solve_ivp(rate, (time, end), state, method="DOP853", **more)
        time, state, inside, touches = piece.t[-1], piece.y[:, -1], not inside, touches + inside
    assert touches >= 2
    for stepper in (vk.FreeFlight(), vk.Order8(1e-11)):
        found = osc.trajectory([0.0, 0.3], periods=4, stepper=stepper).states[-1]
        np.testing.assert_allclose(found, state, rtol=0, atol=1e-8)


def test_supports_add():
    twice = scene(spring=vk.CubicSpring(1.0, 2.0), excitations=(MOVED, MOVED))
    once = scene(spring=vk.CubicSpring(1.0, 2.0), excitations=(MOVED.replace(amplitude=2 * A),))
    ends = [osc.trajectory([0.1, 0.0], periods=2).states[-1] for osc in (twice, once)]
    np.testing.assert_allclose(*ends, rtol=0, atol=1e-9)


def test_equations_of_a_moving_support():
    osc = scene(spring=vk.CubicSpring(1.0, 2.0), excitations=(MOVED,), noise=vk.WhiteNoise(1e-3))
    model = osc.model
    (x, v), t = model.state, model.time
    y = A * sympy.cos(W * t + PHASE)
    bent = x - y
    wanted = -0.02 * (v - sympy.diff(y, t)) - bent - 2 * bent**3
    found = model.drift[1].subs(model.numbers)
    for values in ({x: 0.3, v: -0.2, t: 1.7}, {x: -1.1, v: 0.4, t: 5.0}):
        assert float(found.subs(values)) == pytest.approx(float(wanted.subs(values)), rel=1e-13)
    rate = model.equations[model.momenta[0]].subs(model.numbers).subs({model.momenta[1]: 1})
    assert sympy.simplify(rate + sympy.diff(wanted, x)) == pytest.approx(0, abs=1e-12)


def test_a_linear_response_is_that_of_the_absolute_coordinate():
    """Transmissibility: |x| / a = √(1 + (2ζr)²) / √((1 − r²)² + (2ζr)²)."""
    osc = scene(vk.Barrier(vk.Hertz(50.0), 2.0, "right"), damping_ratio=0.1, excitations=(MOVED,))
    ratio = math.hypot(1, 0.2 * W) / math.hypot(1 - W**2, 0.2 * W)
    assert vk.plausibility(osc).value(Measure.AMPLITUDE) == pytest.approx(A * ratio, rel=1e-6)


class Jumping(vk.Excitation):
    """A support that jumps."""

    period = 2 * math.pi

    def force(self, t):
        return 0

    def support(self, t):
        return sympy.sign(sin(t)) + cos(t)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"spring": vk.CustomSpring("x/(1 - x)"), "excitations": (MOVED,)}, "a place that would move with the support"),
        ({"excitations": (Jumping(),)}, "of the support has no derivative in time"),
    ],
)
def test_what_cannot_be_carried_is_refused(more, said):
    with pytest.raises(DerivationError, match=said):
        _ = scene(**more).model.equations


class Sideways(vk.Excitation):
    """Stiffness that varies beside a pendulum, whose force no longer repeats."""

    period = 2.0

    def force(self, t, x, v):
        return cos(math.pi * t) * x


def test_turns_of_a_pendulum():
    """A shaken support leaves the force as it is a turn further; a stiffness does not."""
    pendulum = scene(spring=vk.CustomSpring("sin(x)"))
    assert turn_of(pendulum.replace(excitations=(MOVED,))) == pytest.approx(2 * math.pi)
    assert turn_of(pendulum.replace(excitations=(Sideways(),))) == 0.0
