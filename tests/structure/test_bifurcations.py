import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, root

import vibrokit as vk
from tests.layers import long
from tests.scenes import double_well, scene
from vibrokit.kernels.choice import single_stepper
from vibrokit.structure.attractors.describe import describe_orbit
from vibrokit.structure.autonomous import find_cycle
from vibrokit.structure.orbits import refine_orbit
from vibrokit.structure.parameter_values import parameter_line
from vibrokit.structure.tracing.branches import Tracing
from vibrokit.structure.tracing.following import Follower
from vibrokit.symbolic.flow_kind import Flow

pytestmark = pytest.mark.slow

FREQUENCY, AMPLITUDE = "excitations.0.frequency", "excitations.0.amplitude"
CLEAR, HAMMERING = (0.4666, 0.0026), (0.0236, -0.0491)  # of hertz-0.570


def passed(osc, path, state, target, *, size=(2.0, 2.0), cycle=False):
    """What a motion meets from where the scene stands to the target, and whether it arrives there stable."""
    stepper, line = single_stepper(osc, Flow.STATE_VARIATIONAL), parameter_line("test", osc, path)
    if cycle:
        orbit = find_cycle(osc, np.array(state), stepper, longest=50.0)
    else:
        orbit = refine_orbit(osc, np.array(state), 1, stepper)
    attractor = describe_orbit(osc, orbit, stepper)
    return Follower(osc, line, np.array(size), stepper).follow(attractor, line.own, target)


def only(followed, kind):
    """The one bifurcation of a kind, located and not only bracketed."""
    (found,) = [one for one in followed.bifurcations if one.kind == kind]
    assert not found.bracketed
    assert found.error < 1e-9
    return found


def rayleigh(*stops, spring="x + v*(v**2 - m)", m=0.2, excitations=()):
    """x″ + x + v³ + (0.1 − m) v: damped at rest for m < 0.1."""
    return scene(*stops, damping_ratio=0.05, spring=vk.CustomSpring(spring, m=m), excitations=excitations)


def both_gaps():
    """A linear response between two stops that do not touch it, and its amplitude."""
    stops = vk.Barrier(vk.Linear(30.0), 0.4, "right"), vk.Barrier(vk.Linear(30.0), -0.8, "left")
    osc = scene(*stops, natural_frequency=2.0, damping_ratio=0.05, excitations=(vk.Harmonic(0.7, 2.9),))
    response = 0.7 / (4 - 2.9**2 + 2j * 0.05 * 2 * 2.9)
    return osc, (response.real, -2.9 * response.imag), abs(response)


BETWEEN, STATE, GAP = both_gaps()
PAPER = vk.load_scene("hertz-0.570")
REACHED = 0.3 * math.hypot(1 - 0.57**2, 0.02 * 0.57)  # amplitude of PAPER with which the linear response is a gap wide
FASTER = brentq(lambda frequency: 0.18 / math.hypot(1 - frequency**2, 0.02 * frequency) - 0.3, 0.57, 0.7, xtol=1e-15)
PUSHED = scene(
    vk.Barrier(vk.Hertz(50.0), 0.5, "right"), natural_frequency=2.0, damping_ratio=0.05,
    excitations=(vk.Constant(0.2),),
)  # fmt: skip
TILTED = double_well(excitations=(vk.Constant(0.0),))
SINGLE = TILTED.replace({"spring.linear": 0.5})
FORCE = "excitations.0.force"
RIGHT, LEFT = "barriers.0.position", "barriers.1.position"
WIDE = (4.0, 4.0)


def stiff(stiffness):
    return PAPER.replace({"barriers.0.law.stiffness": stiffness, "barriers.1.law.stiffness": stiffness})


@pytest.mark.parametrize(
    ("osc", "path", "state", "target", "kind", "value", "end"),
    [
        (BETWEEN, {RIGHT: 1.0, LEFT: -2.0}, STATE, 0.8 * GAP, "grazing", GAP, "none"),
        (BETWEEN, {LEFT: -1.0, RIGHT: 0.5}, STATE, 1.6 * GAP, "grazing", 2 * GAP, "none"),
        (PAPER, FREQUENCY, CLEAR, 0.66, "grazing", FASTER, "stable"),
        (PAPER, AMPLITUDE, CLEAR, 0.203, "grazing", REACHED, "stable"),
        (stiff(1e6), AMPLITUDE, CLEAR, 0.25, "grazing", REACHED, "none"),
        (stiff(1e9), AMPLITUDE, CLEAR, 0.25, "grazing", REACHED, "none"),
        (PUSHED, FORCE, (0.05, 0.0), 3.0, "grazing", 2.0, "stable"),  # ω_n² · 0.5
        (TILTED, FORCE, (-1.0, 0.0), 0.8, "fold", 2 / math.sqrt(27), "none"),  # maximum of x − x³
        (SINGLE, "spring.linear", (0.0, 0.0), -0.7, "pitchfork or transcritical", 0.0, "unstable"),
        (rayleigh(m=-0.3), "spring.m", (0.0, 0.0), 0.4, "Hopf", 0.1, "unstable"),  # the damping at rest vanishes
    ],
)
def test_bifurcations_in_closed_form(osc, path, state, target, kind, value, end):
    followed = passed(osc, path, state, target, size=WIDE if osc.autonomous else (2.0, 2.0))
    found = only(followed, kind)
    assert found.value == pytest.approx(value, abs=1e-10)
    assert found.side == ("right" if kind == "grazing" else "")
    assert end == ("none" if followed.end is None else "stable" if followed.stable else "unstable")


def pressed(law, *, side="right", damping=0.1, amplitude=0.7, frequency=1.5):
    """A mass that a constant force 1 presses against a stop at 0."""
    push = 1.0 if side == "right" else -1.0
    forces = vk.Harmonic(push * amplitude, frequency), vk.Constant(push)
    return scene(vk.Barrier(law, 0.0, side), damping_ratio=damping, excitations=forces)


@pytest.mark.parametrize(("stiffness", "side"), [(9.0, "right"), (9.0, "left"), (1e4, "left")])
def test_a_preloaded_orbit_grazes_where_its_amplitude_is_the_static_depth(stiffness, side):
    frequency = 1.5
    lift_off = math.hypot(1 + stiffness - frequency**2, 0.2 * frequency) / (1 + stiffness)
    osc = pressed(vk.Linear(stiffness), side=side, amplitude=0.99 * lift_off)
    response = 0.99 * lift_off / (1 + stiffness - frequency**2 + 0.2j * frequency)
    state = np.array([1 / (1 + stiffness) + response.real, -frequency * response.imag])
    sign, size = (1, 2.0) if side == "right" else (-1, 2.0)
    followed = passed(osc, AMPLITUDE, sign * state, sign * 1.001 * lift_off, size=(size, size))
    touches = [one for one in followed.bifurcations if one.kind == "grazing"]
    nearest = min(touches, key=lambda one: abs(one.value - sign * lift_off))
    assert nearest.value == pytest.approx(sign * lift_off, abs=1e-10)
    assert (nearest.side, nearest.bracketed) == (side, False)


@pytest.mark.parametrize(
    ("law", "force"),
    [
        (vk.Hertz(20.0), lambda depth: 20 * depth**1.5),
        long(vk.CustomLaw("k*depth**3", k=5.0), lambda depth: 5 * depth**3),
        long(vk.CustomLaw("k*depth**n", k=5.0, n=0.5), lambda depth: 5 * math.sqrt(depth)),
    ],
)
def test_a_preloaded_orbit_grazes_where_an_independent_integration_touches_zero(law, force):
    found = only(passed(pressed(law, damping=0.5, frequency=0.8), AMPLITUDE, (0.3, 0.0), 1.0), "grazing")

    def rates(t, y):
        push = 1.0 + found.value * math.cos(0.8 * t) - force(max(y[0], 0.0))
        return [y[1], push - y[1] - y[0]]

    def turns(t, y):
        return y[1]

    turns.direction = 1
    period = 2 * math.pi / 0.8
    path = solve_ivp(rates, (0, period), found.point, method="DOP853", rtol=1e-12, atol=1e-14, events=turns)
    np.testing.assert_allclose(path.y[:, -1], found.point, atol=1e-8)
    assert path.y_events[0][:, 0].min() == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(("k", "c", "frequency", "side"), [(9.0, 1.0, 1.5, "right"), (20.0, 0.5, 2.0, "left")])
def test_a_preloaded_dash_pot_lets_go_where_its_force_falls_to_zero(k, c, frequency, side):
    """While it pushes, the scene is linear: the force k/(1 + k) at rest, and the amplitude |k + iωc| |X|."""
    unit = 1 / (1 + k - frequency**2 + 1j * frequency * (0.2 + c))
    lift_off = k / (1 + k) / abs((k + 1j * c * frequency) * unit)
    law = vk.CustomLaw("k*depth + c*rate", k=k, c=c)
    osc = pressed(law, side=side, amplitude=0.97 * lift_off, frequency=frequency)
    response, sign = 0.97 * lift_off * unit, 1 if side == "right" else -1
    state = sign * np.array([1 / (1 + k) + response.real, -frequency * response.imag])
    followed = passed(osc, AMPLITUDE, state, sign * 1.03 * lift_off)
    released, left = sorted(followed.bifurcations, key=lambda one: abs(one.value))  # depth reaches 0 later
    assert {released.kind, left.kind} == {"grazing"}
    assert released.value == pytest.approx(sign * lift_off, abs=1e-10)
    assert abs(left.value) > lift_off + 5e-4
    assert (released.side, released.bracketed, left.bracketed) == (side, False, False)


def test_a_limit_cycle_in_contact_grazes_where_an_independent_integration_lifts_off():
    stop = vk.Barrier(vk.Linear(3.0), 0.0, "right")
    osc = rayleigh(stop, excitations=(vk.Constant(1.0),), m=0.25)
    found = only(passed(osc, "spring.m", (0.4, 0.0), 0.32, cycle=True), "grazing")
    # Least x of the cycle of x″ + 0.1 x′ + x + x′(x′² − m) + 3 max(x, 0) = 1 by DOP853 (1e-11), its root in m by Brent.
    assert found.value == pytest.approx(0.2872094587296512, abs=1e-9)


def hertz_map(state, frequency):
    """Image and derivative over one period of the scene hertz-0.570 at another frequency, by SciPy."""

    def rates(t, y):
        right, left = max(y[0] - 0.5, 0.0), max(-0.5 - y[0], 0.0)
        stiffness = 1 + 75 * (math.sqrt(right) + math.sqrt(left))
        push = 0.18 * math.cos(frequency * t) + 0.2 - 50 * (right**1.5 - left**1.5)
        derivative = y[2:].reshape(2, 2)
        turned = np.array([derivative[1], -stiffness * derivative[0] - 0.02 * derivative[1]])
        return [y[1], push - 0.02 * y[1] - y[0], *turned.ravel()]

    start = np.concatenate([state, np.eye(2).ravel()])
    ended = solve_ivp(rates, (0, 2 * math.pi / frequency), start, method="DOP853", rtol=1e-11, atol=1e-13).y[:, -1]
    return ended[:2], ended[2:].reshape(2, 2)


def test_at_a_period_doubling_a_multiplier_is_minus_one():
    found = only(passed(PAPER, FREQUENCY, HAMMERING, 0.53), "period doubling")
    state = found.point
    for _ in range(3):
        image, derivative = hertz_map(state, found.value)
        state = state - np.linalg.solve(derivative - np.eye(2), image - state)
    np.testing.assert_allclose(state, found.point, atol=1e-8)
    multipliers = np.linalg.eigvals(hertz_map(state, found.value)[1])
    assert multipliers.real.min() == pytest.approx(-1.0, abs=1e-6)
    assert np.prod(multipliers) == pytest.approx(math.exp(-0.02 * 2 * math.pi / found.value), rel=1e-7)


def test_the_cascade_between_periods_1_and_4_has_both_its_doublings():
    osc, found = PAPER, []
    stepper = single_stepper(osc, Flow.STATE_VARIATIONAL)
    for frequency, point, period in ((0.525, (0.0966, -0.0271), 4), (0.57, (0.0236, -0.0491), 1)):
        there = osc.replace({FREQUENCY: frequency})
        found.append([describe_orbit(there, refine_orbit(there, np.array(point), period, stepper), stepper)])
    follower = Follower(osc, parameter_line("test", osc, FREQUENCY), np.array([1.5, 1.5]), stepper)
    tracing = Tracing(follower, [0.525, 0.57], found)
    tracing.run()
    assert tracing.numbered == [[0], [0]]
    doublings = {one.period: one for _, one in tracing.located if one.kind == "period doubling"}
    assert set(doublings) == {1, 2}
    assert 0.525 < doublings[2].value < doublings[1].value < 0.57
    # That the orbit of period 2 has a multiplier −1 where it doubles, SciPy says.
    state, derivative = doublings[2].point, np.eye(2)
    for _ in range(2):
        state, over_one = hertz_map(state, doublings[2].value)
        derivative = over_one @ derivative
    np.testing.assert_allclose(state, doublings[2].point, atol=1e-8)
    assert np.linalg.eigvals(derivative).real.min() == pytest.approx(-1.0, abs=1e-6)


def duffing_fold(frequency, sines):
    """Fold of x″ + 0.1x′ + x + 0.3x³ = 0.4 cos ωt, by collocation on a Fourier series instead of integration in time.

    The orbit, the null vector of its equations and ω are unknown at once; the start is one cosine and sine.
    """
    count = 48
    angle = 2 * math.pi * np.arange(count) / count
    waves = np.fft.fftfreq(count, 1 / count)
    spectrum = np.fft.fft(np.eye(count), axis=0)
    first = np.fft.ifft(1j * np.where(np.abs(waves) == count / 2, 0, waves)[:, None] * spectrum, axis=0).real
    second = np.fft.ifft(-(waves**2)[:, None] * spectrum, axis=0).real

    def linearised(x, omega):
        return omega**2 * second + 0.1 * omega * first + np.diag(1 + 0.9 * x**2)

    def equations(unknowns):
        x, null, omega = unknowns[:count], unknowns[count:-1], unknowns[-1]
        motion = (omega**2 * second + 0.1 * omega * first) @ x + x + 0.3 * x**3 - 0.4 * np.cos(angle)
        return np.concatenate([motion, linearised(x, omega) @ null, [null @ null - 1]])

    start = sines[0] * np.cos(angle) + sines[1] * np.sin(angle)
    null = np.linalg.svd(linearised(start, frequency))[2][-1]
    solved = root(equations, np.concatenate([start, null, [frequency]]), tol=1e-12)
    assert np.abs(solved.fun).max() < 1e-9
    return solved.x[-1]


def test_duffing_folds_where_collocation_says():
    osc = vk.load_scene("duffing")
    for state, target in (((-0.426, 0.0916), 1.1), ((1.3586, 2.4173), 1.8)):
        found = only(passed(osc, FREQUENCY, state, target, size=(6.0, 6.0)), "fold")
        sines = (found.point[0], found.point[1] / found.value)
        assert found.value == pytest.approx(duffing_fold(found.value, sines), abs=1e-8)
        assert abs(found.value - target) > 0.1  # it turned back on the way


def test_a_limit_cycle_grazes_where_it_reaches_the_stop():
    stop = vk.Barrier(vk.Hertz(50.0), 0.5, "right")
    followed = passed(rayleigh(stop), "spring.m", (0.36, 0.0), 0.4, cycle=True)
    found = only(followed, "grazing")

    def rates(t, y):
        return [y[1], -y[0] - (0.1 - found.value) * y[1] - y[1] ** 3]

    def turns(t, y):
        return y[1]

    turns.direction = -1
    settled = solve_ivp(rates, (0, 600), [0.5, 0.0], method="DOP853", rtol=1e-12, atol=1e-13, events=turns)
    assert settled.y_events[0][-1][0] == pytest.approx(0.5, abs=1e-9)
    assert followed.stable


def test_at_a_torus_bifurcation_a_pair_of_multipliers_is_on_the_unit_circle():
    osc = rayleigh(m=0.3, excitations=(vk.Harmonic(0.2, 1.0),))
    followed = passed(osc, FREQUENCY, (-0.0605, 0.7755), 1.4, size=(4.0, 4.0))
    found = only(followed, "Neimark–Sacker")

    def rates(t, y):
        derivative = y[2:].reshape(2, 2)
        turned = np.array([derivative[1], -derivative[0] - (3 * y[1] ** 2 - 0.2) * derivative[1]])
        return [y[1], 0.2 * math.cos(found.value * t) - y[0] - y[1] * (y[1] ** 2 - 0.2), *turned.ravel()]

    start = np.concatenate([found.point, np.eye(2).ravel()])
    ended = solve_ivp(rates, (0, 2 * math.pi / found.value), start, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    np.testing.assert_allclose(ended[:2], found.point, atol=1e-9)
    multipliers = np.linalg.eigvals(ended[2:].reshape(2, 2))
    np.testing.assert_allclose(np.abs(multipliers), 1.0, atol=1e-8)
    assert np.abs(multipliers.imag).min() > 0.1
    assert not followed.stable


def test_nothing_is_said_of_motion_that_stays_unstable():
    osc = vk.load_scene("double-well").replace({"damping_ratio": 0.05})
    followed = passed(osc, "spring.linear", (0.0, 0.0), -0.2)
    assert followed.bifurcations == ()
    assert followed.end is not None
    assert not followed.stable
