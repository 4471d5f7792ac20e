"""A stop whose force jumps at first touch refracts extremal paths: H is conserved, p₁ jumps, and so do derivatives."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from vibrokit_hunt_crossley import HuntCrossley

import vibrokit as vk
from vibrokit.errors import StepperError
from vibrokit.kernels.choice import ensemble_stepper
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.kernel import kernel_for
from vibrokit.kernels.single import record
from vibrokit.kernels.stopping import COMPLETED, GRAZED
from vibrokit.symbolic.flow_kind import Flow

WALL, K, C, DAMPING = 0.3, 40.0, 0.6, 0.1
START = np.array([0.1, 0.7, 0.3, -0.2, 0.0])
LEFTWARDS = START * [-1, -1, 1, 1, 1]
FIRM = vk.FreeFlight(1e-13)


def one_stop(law):
    return scene(barriers=(vk.Barrier(law, WALL, "right"),))


def scene(adhesive=False, damping=C, preload=0.0, **parts):
    """Between a stop whose force jumps, on the right, and one of which only the slope does, somewhere."""
    jumping = vk.CustomLaw("f + k*depth + c*rate", f=preload, k=K, c=damping)
    bending = vk.Linear(K) if adhesive else vk.CustomLaw("k*depth**1.5*(1 + c*rate)", k=K, c=2.0)
    settings = {
        "natural_frequency": 1.0,
        "damping_ratio": DAMPING / 2,
        "barriers": (vk.Barrier(jumping, WALL, "right", adhesive), vk.Barrier(bending, -WALL, "left")),
        "excitations": (vk.Harmonic(0.1, 0.8),),
        "noise": vk.WhiteNoise(1e-3),
    }
    return vk.Oscillator(**(settings | parts))


def carried(osc, start=START, duration=1.5, stepper=FIRM):
    """End of one path."""
    path = record(osc, Flow.HAMILTONIAN, stepper, np.asarray(start), 0.2, duration, 1)
    assert len(path) == 2
    return path[-1]


def energy(z):
    """H of the unforced scene outside the stop."""
    x, v, p1, p2, _ = z
    assert abs(x) < WALL
    return p1 * v - p2 * (DAMPING * v + x) + p2 * p2 / 2


# --- H


@pytest.mark.slow
@pytest.mark.parametrize(
    ("stepper", "adhesive"),
    [(FIRM, False), (vk.Order8(1e-13), False), (FIRM, True)],
    ids=["flight", "order8", "adhesive"],
)
def test_the_hamiltonian_is_conserved_through_a_bounce(stepper, adhesive):
    osc = scene(adhesive, excitations=(vk.Harmonic(0.0, 0.8),))
    for p1, p2 in ((0.3, -0.2), (-0.4, 0.5), (1e-5, 2e-5)):
        start = np.array([0.1, 0.7, p1, p2, 0.0])
        end = carried(osc, start, 1.0, stepper)
        assert end[1] < 0.0  # it has been there
        assert abs(energy(end) - energy(start)) < 1e-9 * abs(energy(start))


# --- the limit of laws that do not jump


def ramped(start, begin, duration, width, adhesive):
    """SciPy's path under damping that sets in over a depth `width`, restarted wherever its formula changes."""

    def rates(t, z, part):
        x, v, p1, p2, _ = z
        depth = x - WALL
        share, slope = {"off": (0.0, 0.0), "ramp": (depth / width, 1.0 / width), "full": (1.0, 0.0)}[part]
        stiffness = 0.0 if part == "off" else K
        push = stiffness * depth + C * share * v
        force = 0.1 * math.cos(0.8 * t) - x - DAMPING * v - push
        in_x, in_v = -1.0 - stiffness - C * slope * v, -DAMPING - C * share
        return [v, force + p2, -in_x * p2, -p1 - in_v * p2, p2 * p2 / 2]

    def event(function, direction):
        def watched(t, z, _):
            return function(*z[:2])

        watched.terminal, watched.direction = True, direction
        return watched

    route = [("off", lambda x, v: x - WALL, 1.0), ("ramp", lambda x, v: x - WALL - width, 1.0)]
    if adhesive:
        route += [("full", lambda x, v: x - WALL - width, -1.0), ("ramp", lambda x, v: x - WALL, -1.0)]
    else:
        route += [("full", lambda x, v: K * (x - WALL) + C * v, -1.0)]
    t, z = begin, np.array(start)
    for part, function, direction in [*route, ("off", lambda x, v: 1.0, 1.0)]:
        watched = event(function, direction)
        done = solve_ivp(
            rates, (t, begin + duration), z, "DOP853", args=(part,), rtol=1e-12, atol=1e-14, events=watched
        )
        t, z = done.t[-1], done.y[:, -1]
    assert t == begin + duration
    return z


@pytest.mark.slow
@pytest.mark.parametrize("adhesive", [False, True])
def test_it_is_the_limit_of_damping_that_sets_in_ever_faster(adhesive):
    found = carried(scene(adhesive))
    errors = np.array([ramped(START, 0.2, 1.5, width, adhesive) - found for width in (1e-3, 1e-4, 1e-5)])
    sizes = np.linalg.norm(errors, axis=1)
    assert sizes[0] < 0.1
    assert 8.0 < sizes[0] / sizes[1] < 12.5
    assert 8.0 < sizes[1] / sizes[2] < 12.5
    assert np.abs(10 * errors[2] - errors[1]).max() < 0.01 * sizes[1]  # what is left is of second order


# --- derivatives

SYMPLECTIC = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.eye(2), np.zeros((2, 2))]])


def derivative(osc, start, stepper=FIRM):
    whole = np.concatenate([start, np.eye(4).ravel()])
    (end,) = run_ensemble(osc, Flow.HAMILTONIAN_VARIATIONAL, stepper, whole[None], start_time=0.2, interval=1.5).states
    return end[:5], end[5:].reshape(4, 4)


@pytest.mark.slow
@pytest.mark.parametrize("adhesive", [False, True])
@pytest.mark.parametrize("start", [START, LEFTWARDS], ids=["right", "left"])
def test_derivatives_are_those_of_the_flow(adhesive, start):
    """Where the force jumps; where only its slope does; and where a law that would pull is cut inside the stop."""
    osc = scene(adhesive)
    end, matrix = derivative(osc, start)
    step = 1e-5
    moved = [(carried(osc, start + step * e) - carried(osc, start - step * e))[:4] for e in np.eye(5)[:4]]
    differences = np.array(moved).T / (2 * step)
    np.testing.assert_allclose(end, carried(osc, start), atol=1e-11)
    np.testing.assert_allclose(matrix, differences, atol=1e-7 * np.abs(differences).max())
    assert np.abs(matrix.T @ SYMPLECTIC @ matrix - SYMPLECTIC).max() < 1e-7


@pytest.mark.slow
def test_fixed_steps_have_the_derivatives_without_momentum_only():
    """There to first order of the step, 1e-4, times the rate of the stop: the slope of its force jumps."""
    stop, steps = vk.Barrier(vk.Linear(K), -WALL, "left"), vk.RK4(65536)
    still = LEFTWARDS * [1, 1, 0, 0, 0]
    exact, found = derivative(scene(True), still)[1], derivative(scene(barriers=(stop,)), still, steps)[1]
    assert np.abs(found - exact).max() < 1e-2 * np.abs(exact).max()
    exact, found = derivative(scene(True), LEFTWARDS)[1], derivative(scene(barriers=(stop,)), LEFTWARDS, steps)[1]
    assert np.abs(found - exact).max() > 0.1 * np.abs(exact).max()


# --- grazing


def tangent_start(beyond, momentum):
    """Start of a path that turns `beyond` the place of the stop where there is none, found by SciPy."""

    def turning(v):
        def rates(t, z):
            x, v, p1, p2, _ = z
            force = 0.1 * math.cos(0.8 * t) - x - DAMPING * v
            return [v, force + p2, p2, DAMPING * p2 - p1, p2 * p2 / 2]

        def turn(t, z):
            return z[1]

        turn.terminal, turn.direction = True, -1.0
        start = [0.0, v, *momentum, 0.0]
        done = solve_ivp(rates, (0.2, 5.0), start, "DOP853", rtol=1e-13, atol=1e-16, events=turn, max_step=0.05)
        return done.y[0, -1] - WALL - beyond

    return np.array([0.0, brentq(turning, 0.1, 0.5, xtol=1e-15, rtol=1e-15), *momentum, 0.0])


STEPPER = vk.FreeFlight(1e-10)


@pytest.mark.parametrize(("damping", "preload"), [(C, 0.0), (0.0, 0.3)], ids=["damped", "preloaded"])
@pytest.mark.parametrize(
    ("beyond", "momentum", "grazed"),
    [
        (1e-12, (2e-3, 3e-3), True),
        (1e-6, (2e-3, 3e-3), False),
        (-1e-6, (2e-3, 3e-3), False),
        (1e-12, (0.0, 0.0), False),
    ],
    ids=["too slow", "fast enough", "untouched", "without noise"],
)
def test_a_touch_too_slow_ends_the_path(damping, preload, beyond, momentum, grazed):
    """Speeds of 8e-7 and 8e-4 at the touch; known to the root of the tolerance, 1e-5."""
    osc, start = scene(damping=damping, preload=preload), tangent_start(beyond, momentum)
    path = record(osc, Flow.HAMILTONIAN, STEPPER, start, 0.2, 0.1, 30)
    ended = run_ensemble(osc, Flow.HAMILTONIAN, STEPPER, start[None], 1, start_time=0.2, interval=3.0)
    if grazed:
        assert 1 < len(path) < 31
        assert np.abs(path[-1, 0] - WALL) < 0.01
        assert (ended.status[0], ended.intervals[0]) == (GRAZED, 0)
        np.testing.assert_array_equal(ended.states[0], start)
    else:
        assert len(path) == 31
        assert np.isfinite(path).all()
        assert (ended.status[0], ended.intervals[0]) == (COMPLETED, 1)


def test_derivatives_of_momenta_are_refused_at_grazing_too():
    whole = np.concatenate([tangent_start(1e-12, (2e-3, 3e-3)), np.eye(4).ravel()])
    ended = run_ensemble(scene(), Flow.HAMILTONIAN_VARIATIONAL, STEPPER, whole[None], 1, start_time=0.2, interval=3.0)
    assert ended.status[0] == GRAZED


# --- who may follow it, and what others pay


def test_fixed_steps_refuse_momenta_that_jump():
    osc = scene()
    for flow in (Flow.HAMILTONIAN, Flow.HAMILTONIAN_VARIATIONAL):
        with pytest.raises(StepperError, match="momenta jump too"):
            kernel_for(osc, flow, vk.RK4())
        assert isinstance(ensemble_stepper(osc, flow), vk.Order8)


def test_who_chooses_for_derivatives():
    flow = Flow.HAMILTONIAN_VARIATIONAL
    assert isinstance(ensemble_stepper(one_stop(vk.Linear(K)), flow), vk.Order8)
    assert isinstance(ensemble_stepper(one_stop(vk.Hertz(K)), flow), vk.RK4)
    assert isinstance(ensemble_stepper(one_stop(vk.Linear(K)), Flow.HAMILTONIAN), vk.RK4)


def what_jumps(law, flow):
    """0 nothing, 1 derivatives and covariances, 2 momenta, 3 momenta and their derivatives."""
    return kernel_for(one_stop(law), flow, FIRM).module.CROSSING[0]


def test_nothing_jumps_at_laws_that_begin_at_zero():
    for law in (vk.Hertz(K), vk.Linear(K), HuntCrossley(K, 0.4)):
        for flow in (Flow.STATE, Flow.STATE_VARIATIONAL, Flow.LINEARISED, Flow.HAMILTONIAN):
            assert what_jumps(law, flow) == 0
    assert what_jumps(vk.Hertz(K), Flow.HAMILTONIAN_VARIATIONAL) == 0
    damped = vk.CustomLaw("k*depth + c*rate", k=K, c=C)
    assert what_jumps(damped, Flow.STATE) == 0
    assert what_jumps(damped, Flow.STATE_VARIATIONAL) == 1
    assert what_jumps(damped, Flow.HAMILTONIAN) == 2
    assert what_jumps(HuntCrossley(K, 0.4), Flow.HAMILTONIAN_VARIATIONAL) == 3
