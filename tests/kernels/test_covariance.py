"""The covariance that noise gathers along a motion: SciPy's DOP853 on its equations, and exponentials of matrices."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq

import vibrokit as vk
from tests.layers import slow
from tests.scenes import Coupled
from vibrokit.errors import SceneError, StepperError
from vibrokit.kernels.choice import ensemble_stepper, single_stepper
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.structure.linear_map import gaussian_map
from vibrokit.symbolic.flow_kind import Flow

OMEGA, STOP, STIFFNESS, DAMPING = 0.57, 0.5, 50.0, 0.02
FLIP = np.diag([1.0, -1.0])
LOCATED = (vk.FreeFlight(1e-13), vk.Order8(1e-13))
HITTING = [(0.0235822019, -0.0490713265), (0.3, 0.4), (-0.2, 0.6)]
CLEAR = (0.4, 0.0)  # it stays between the stops for an eighth of the period


@pytest.fixture(scope="module")
def paper():
    return vk.load_scene("hertz-0.570")


def linearised(osc, stepper, state, start_time=0.0, interval=None):
    """Where a motion ends, the derivative of that by the start, and the covariance."""
    found = gaussian_map(osc, np.array([state]), stepper, start_time=start_time, interval=interval)
    return found.images[0], found.derivatives[0], found.covariances[0]


def carried(osc, stepper, state, start_time=0.0, interval=None):
    """Where a motion ends, and its covariance."""
    end, _, covariance = linearised(osc, stepper, state, start_time, interval)
    return end, covariance


def carried_back(osc, stepper, state, start_time, interval):
    """The same of the motion backwards in time."""
    start = np.concatenate([state, np.zeros(3)])
    ended = run_ensemble(osc, Flow.COVARIANCE_REVERSED, stepper, start[None], start_time=start_time, interval=interval)
    return ended.states[0, :2], ended.states[0, [2, 3, 3, 4]].reshape(2, 2)


def reference(state, start, duration, amplitude):
    """End, its derivative M by the start, and C, for the scene of the paper; restarted at each touch of a stop."""

    def rates(t, z, side):
        x, v, matrix, covariance = z[0], z[1], z[2:6].reshape(2, 2), z[6:].reshape(2, 2)
        depth = max(side * x - STOP, 0.0) if side else 0.0
        force = 0.18 * math.cos(OMEGA * t) + 0.2 - x - DAMPING * v - side * STIFFNESS * depth**1.5
        slope = np.array([[0.0, 1.0], [-1.0 - 1.5 * STIFFNESS * math.sqrt(depth), -DAMPING]])
        gathered = slope @ covariance + covariance @ slope.T + np.diag([0.0, amplitude(x, v) ** 2])
        return np.concatenate([[v, force], (slope @ matrix).ravel(), gathered.ravel()])

    def touch(sign, direction):
        def event(t, z, _):
            return sign * z[0] - STOP

        event.terminal, event.direction = True, direction
        return event

    t, z = start, np.concatenate([state, np.eye(2).ravel(), np.zeros(4)])
    side = next((sign for sign in (1, -1) if sign * z[0] > STOP), 0)
    while t < start + duration:
        events = [touch(side, -1.0)] if side else [touch(1, 1.0), touch(-1, 1.0)]
        part = solve_ivp(rates, (t, start + duration), z, "DOP853", args=(side,), rtol=1e-13, atol=1e-16, events=events)
        t, z = part.t[-1], part.y[:, -1]
        if part.status == 1:
            side = 0 if side else (1 if len(part.t_events[0]) else -1)
    return z[:2], z[2:6].reshape(2, 2), z[6:].reshape(2, 2)


def additive(x, v):
    return 1.0


def gathered_in(matrix, diffusion, duration):
    """Derivative and covariance of linear motion, after Van Loan (IEEE Trans. Autom. Control 23, 395, 1978)."""
    size, halvings = len(matrix), 6  # backwards, a long time would be lost in rounding
    whole = expm(duration / 2**halvings * np.block([[-matrix, diffusion], [np.zeros_like(matrix), matrix.T]]))
    moved = whole[size:, size:].T
    covariance = moved @ whole[:size, size:]
    for _ in range(halvings):
        moved, covariance = moved @ moved, moved @ covariance @ moved.T + covariance
    return moved, covariance


def off(found, true):
    """Largest error of an entry, relative to the size that its row and column give it."""
    size = np.sqrt(np.diag(true))
    return (np.abs(found - true) / np.outer(size, size)).max()


# --- the equations


@pytest.mark.slow
@pytest.mark.parametrize("stepper", LOCATED, ids=lambda s: s.name)
def test_through_the_stops_of_the_paper(paper, stepper):
    for start in HITTING:
        end, moved, true = reference(start, 0.4, paper.section_interval, additive)
        found, derivative, covariance = linearised(paper, stepper, start, 0.4)
        assert np.abs(found - end).max() < 1e-10
        assert np.abs(derivative - moved).max() < 1e-9 * np.abs(moved).max()
        assert off(covariance, true) < 1e-9


@pytest.mark.slow
def test_fixed_steps_converge(paper):
    """Across a Hertz contact the slope of the force, that C feels, goes like the root of the depth: order 1.5."""
    true = [reference(start, 0.0, paper.section_interval, additive)[2] for start in HITTING]
    errors = []
    for steps in (512, 2048, 8192):
        found = [carried(paper, vk.RK4(steps), start)[1] for start in HITTING]
        errors.append(np.mean([off(*pair) for pair in zip(found, true, strict=True)]))
    assert errors[2] < 1e-2
    assert errors[2] < errors[0] / 16


@pytest.mark.parametrize(
    ("stepper", "duration"),
    [*((stepper, duration) for stepper in LOCATED for duration in (1e-3, 1e-2, 1.0)), (vk.RK4(4096), 1.0)],
    ids=repr,
)
def test_short_times_between_the_stops(paper, stepper, duration):
    """C_xx = t³/3 beside C_vv = t: each entry is right by its own size."""
    matrix = np.array([[0.0, 1.0], [-1.0, -DAMPING]])
    _, true = gathered_in(matrix, np.diag([0.0, 1.0]), duration)
    _, found = carried(paper, stepper, CLEAR, interval=duration)
    np.testing.assert_allclose(found, true, rtol=1e-8)


@pytest.mark.parametrize("stepper", [vk.FreeFlight(1e-12), slow(vk.RK4(16384))], ids=lambda s: s.name)
def test_states_of_the_noise_have_a_covariance_too(stepper):
    osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.3, noise=Coupled(intensity=1e-3, rate=9.0))
    matrix = np.array([[0.0, 1.0, 0.0], [-1.0, -0.6, 1.0], [0.0, 0.2, -9.0]])
    moved, true = gathered_in(matrix, np.diag([0.0, 0.0, 4.0]), osc.section_interval)
    start = np.array([0.3, -0.2, 0.5])
    end, found = carried(osc, stepper, start)
    np.testing.assert_allclose(end, moved @ start, atol=1e-9)
    assert off(found, true) < 1e-9


# --- backwards


@pytest.mark.slow
def test_backwards_it_is_the_covariance_pulled_back_to_the_start(paper):
    stepper, duration, begin = vk.FreeFlight(1e-13), 5.0, 0.4
    for start in HITTING:
        end, moved, covariance = reference(start, begin, duration, additive)
        found, backwards = carried_back(paper, stepper, FLIP @ end, -begin - duration, duration)
        back = np.linalg.inv(moved)
        assert np.abs(FLIP @ found - start).max() < 1e-9
        assert off(FLIP @ backwards @ FLIP, back @ covariance @ back.T) < 1e-8


@pytest.mark.slow
def test_noise_that_depends_on_the_velocity(paper):
    """Its amplitude backwards is that of the velocity forwards."""
    osc = vk.Oscillator(
        natural_frequency=1.0,
        damping_ratio=DAMPING / 2,
        barriers=paper.barriers,
        excitations=paper.excitations,
        noise=vk.StateDependentNoise(1e-5, "1 + v/2 + x**2"),
    )
    stepper, duration = single_stepper(osc, Flow.LINEARISED), 4.0
    assert isinstance(stepper, vk.Order8)
    with pytest.raises(StepperError, match="FreeFlight needs linear motion"):
        carried(osc, vk.FreeFlight(), CLEAR)
    start = HITTING[1]
    end, moved, true = reference(start, 0.0, duration, lambda x, v: 1 + v / 2 + x**2)
    assert off(carried(osc, stepper, start, interval=duration)[1], true) < 1e-7
    found, backwards = carried_back(osc, stepper, FLIP @ end, -duration, duration)
    back = np.linalg.inv(moved)
    assert np.abs(FLIP @ found - start).max() < 1e-7
    assert off(FLIP @ backwards @ FLIP, back @ true @ back.T) < 1e-6


# --- forces that jump

WALL, K, C = 0.3, 40.0, 0.6


def damped_stop(adhesive):
    law = vk.CustomLaw("k*depth + c*rate", k=K, c=C)
    return vk.Oscillator(
        natural_frequency=1.0,
        damping_ratio=0.05,
        barriers=(vk.Barrier(law, WALL, "right", adhesive),),
        noise=vk.WhiteNoise(1e-3),
    )


class Piecewise:
    """Linear motion from event to event by exponentials of matrices, with derivative and covariance carried along."""

    FREE = np.array([[0.0, 1.0], [-1.0, -0.1]]), np.zeros(2)
    PUSHED = np.array([[0.0, 1.0], [-1.0 - K, -0.1 - C]]), np.array([-WALL * K / (1.0 + K), 0.0])  # less its rest

    def __init__(self, state):
        self.state, self.time = np.array(state), 0.0
        self.derivative, self.covariance = np.eye(2), np.zeros((2, 2))

    def follow(self, law, duration):
        matrix, shift = law
        moved, more = gathered_in(matrix, np.diag([0.0, 1.0]), duration)
        self.state = moved @ (self.state + shift) - shift
        self.derivative = moved @ self.derivative
        self.covariance = moved @ self.covariance @ moved.T + more
        self.time += duration

    def until(self, law, function, low, high):
        """Follow a law until a function of the state is zero, between two durations."""
        matrix, shift = law

        def value(duration):
            return function(*(expm(duration * matrix) @ (self.state + shift) - shift))

        self.follow(law, brentq(value, low, high, xtol=1e-15, rtol=1e-15))

    def jump(self, force):
        """The mass enters (force < 0) or leaves a force that jumps."""
        saltation = np.array([[1.0, 0.0], [force / self.state[1], 1.0]])
        self.derivative = saltation @ self.derivative
        self.covariance = saltation @ self.covariance @ saltation.T


@pytest.mark.slow
@pytest.mark.parametrize("adhesive", [False, True])
def test_a_damped_stop_in_closed_form(adhesive):
    osc, duration = damped_stop(adhesive), 3.0
    true = Piecewise([0.1, 0.7])
    true.until(true.FREE, lambda x, v: x - WALL, 0.1, 1.0)
    true.jump(-C * true.state[1])
    if adhesive:
        true.until(true.PUSHED, lambda x, v: x - WALL, 0.1, 0.6)
        true.jump(C * true.state[1])
    else:
        true.until(true.PUSHED, lambda x, v: K * (x - WALL) + C * v, 0.1, 0.6)
        true.until(true.FREE, lambda x, v: x - WALL, 1e-9, 0.3)
    true.follow(true.FREE, duration - true.time)
    end, derivative, covariance = linearised(osc, vk.FreeFlight(1e-13), [0.1, 0.7], interval=duration)
    np.testing.assert_allclose(end, true.state, atol=1e-11)
    np.testing.assert_allclose(derivative, true.derivative, atol=1e-10)
    assert off(covariance, true.covariance) < 1e-10


def test_fixed_steps_refuse_forces_that_jump():
    osc = damped_stop(False)
    with pytest.raises(StepperError, match="FreeFlight or Order8"):
        carried(osc, vk.RK4(), CLEAR)
    assert isinstance(ensemble_stepper(osc, Flow.LINEARISED), vk.Order8)
    assert isinstance(ensemble_stepper(osc, Flow.COVARIANCE_REVERSED), vk.Order8)


# --- choice


def test_steppers_chosen(paper):
    for flow in (Flow.LINEARISED, Flow.COVARIANCE_REVERSED):
        assert ensemble_stepper(paper, flow) == vk.RK4(256)
        assert isinstance(single_stepper(paper, flow), vk.FreeFlight)


def test_without_noise_there_is_none():
    osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.1)
    with pytest.raises(SceneError, match="no random forces"):
        carried(osc, vk.RK4(), CLEAR)
