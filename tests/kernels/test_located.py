"""The steppers that locate every contact."""

import dataclasses
import itertools

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

import vibrokit as vk
from tests.layers import slow
from vibrokit.kernels.ensemble import Stop, advance_block
from vibrokit.kernels.kernel import kernel_for, theta_of
from vibrokit.kernels.stopping import COMPLETED, DIVERGED, LEFT_REGION, STALLED
from vibrokit.symbolic.flow_kind import Flow

DAMPING, STIFFNESS, AMPLITUDE, FREQUENCY, FORCE, HERTZ, STOP = 0.02, 1.0, 0.18, 0.57, 0.2, 50.0, 0.5
PERIOD = 2 * np.pi / FREQUENCY
EVERYWHERE = np.array([[-np.inf, np.inf], [-np.inf, np.inf]])
SCENE = vk.Oscillator(
    natural_frequency=np.sqrt(STIFFNESS),
    damping_ratio=DAMPING / 2,
    barriers=(vk.Barrier(vk.Hertz(HERTZ), STOP, "right"), vk.Barrier(vk.Hertz(HERTZ), -STOP, "left")),
    excitations=(vk.Harmonic(AMPLITUDE, FREQUENCY), vk.Constant(FORCE)),
    noise=vk.WhiteNoise(intensity=1.0),
)
# Its force would pull at release.
PULLING = vk.CustomLaw("k*depth**1.5*(1 + c*rate)", k=HERTZ, c=3.0)


def theta(damping=DAMPING, amplitude=AMPLITUDE, force=FORCE, right=HERTZ, left=HERTZ, right_stop=STOP, left_stop=-STOP):
    changed = dataclasses.replace(
        SCENE,
        damping_ratio=damping / 2,
        barriers=(
            vk.Barrier(vk.Hertz(right), right_stop, "right"),
            vk.Barrier(vk.Hertz(left), left_stop, "left"),
        ),
        excitations=(vk.Harmonic(amplitude, FREQUENCY), vk.Constant(force)),
    )
    return theta_of(changed)


@pytest.fixture(scope="module", params=[vk.Order8(), vk.FreeFlight()], ids=lambda stepper: stepper.name)
def kernel(request):
    return kernel_for(SCENE, Flow.HAMILTONIAN, request.param)


@pytest.fixture(scope="module")
def clamped():
    barriers = (vk.Barrier(PULLING, STOP, "right"), vk.Barrier(PULLING, -STOP, "left"))
    scene = dataclasses.replace(SCENE, barriers=barriers)
    return kernel_for(scene, Flow.HAMILTONIAN, vk.Order8()), theta_of(scene)


def advance(kernel, states, tolerance, intervals=1, values=None, **more):
    out, done, status, _ = outputs(kernel, states, tolerance, intervals, values, **more)
    return out, done, status


def path(kernel, state, tolerance, spacing, samples, values=None):
    """States after each sample of a motion that goes on."""
    _, done, _, visits = outputs(
        kernel, state, tolerance, samples, values, interval=spacing, cycle=0.0, span=samples * spacing, visits=samples
    )
    return visits[0, : done[0]]


def outputs(
    kernel, states, tolerance, intervals, values, interval=PERIOD, limit=1e5, region=EVERYWHERE, cycle=1.0, span=0.0,
    visits=0,
):  # fmt: skip
    states = np.atleast_2d(np.asarray(states, dtype=float))
    count = len(states)
    settings = np.array(vk.Order8(tolerance).settings(SCENE, interval))  # the driver reads as many as a stepper has
    settings[1:6] = limit, cycle, 1.0, span, np.inf
    ended = advance_block(
        kernel, states, np.full(count, intervals), (theta() if values is None else values, 0.0, interval, settings),
        np.empty((count, 0), dtype=np.uint64), np.zeros(count, dtype=np.int64), Stop(region=region), visits, 1,
    )  # fmt: skip
    return ended.states, ended.intervals, ended.status, ended.visits


def starts(count, momentum=1e-6):
    rng = np.random.default_rng(5)
    x, v = rng.uniform(-0.49, 0.49, count), rng.uniform(-0.9, 0.9, count)
    return np.column_stack([x, v, momentum * rng.normal(size=(count, 2)), np.zeros(count)])


def test_error_follows_the_tolerance(kernel):
    states = starts(8)
    (true, done, status), *others = (advance(kernel, states, 10.0**-k, 2) for k in (14, 5, 7, 9, 11))
    assert (status == COMPLETED).all()
    assert (done == 2).all()
    medians = [np.median(np.abs(found - true)[:, :2].max(axis=1)) for found, *_ in others]
    assert all(finer < 0.1 * coarser for coarser, finer in itertools.pairwise(medians))
    assert medians[-1] < 1e-9


def test_action_scales_with_tiny_momenta(kernel):
    large, small = (advance(kernel, starts(8, momentum), 1e-12, 2)[0] for momentum in (1e-11, 1e-13))
    assert np.allclose(large[:, 2:4] * 1e-2, small[:, 2:4], rtol=1e-6, atol=0)
    assert np.allclose(large[:, 4] * 1e-4, small[:, 4], rtol=1e-6, atol=0)


def test_start_exactly_at_touch(kernel):
    """Going in, it is the mirror of coming out; at rest, the acceleration decides; resting, it stays."""
    free = theta(damping=0.0, amplitude=0.0, force=0.0)
    into, duration = [STOP, 0.4, 0, 0, 0], 0.2
    deep = advance(kernel, into, 1e-14, interval=duration, values=free)[0][0]
    assert deep[0] > STOP
    back = advance(kernel, deep * [1, -1, 1, 1, 1], 1e-14, interval=duration, values=free)[0][0]
    assert back[:2] == pytest.approx([STOP, -0.4], abs=1e-12)
    away = advance(kernel, [STOP, 0, 0, 0, 0], 1e-13, interval=1.0, values=free)[0][0]
    assert away[:2] == pytest.approx([STOP * np.cos(1.0), -STOP * np.sin(1.0)], abs=1e-12)
    pressed = theta(damping=2.0, amplitude=0.0, force=2.0)
    rest = advance(kernel, [STOP, 0, 0, 0, 0], 1e-13, intervals=8, values=pressed)[0][0]
    assert rest[1] == pytest.approx(0.0, abs=1e-12)
    assert STIFFNESS * rest[0] + HERTZ * (rest[0] - STOP) ** 1.5 == pytest.approx(2.0, abs=1e-12)
    balanced = theta(damping=0.1, amplitude=0.0, force=STOP)
    still = advance(kernel, [STOP, 0, 0, 0, 0], 1e-13, intervals=3, values=balanced)[0][0]
    assert still[:2] == pytest.approx([STOP, 0.0], abs=1e-14)


def time_in_contact(beyond, stiffness):
    """Of an undamped mass that would turn `beyond` the stop without it."""
    # Energy: beyond (1 + beyond) = depth + depth² + 0.8 k depth^(5/2) at the turning point.
    energy = beyond * (1 + beyond)
    deepest = brentq(lambda d: d + d * d + 0.8 * stiffness * d**2.5 - energy, 0, beyond, xtol=1e-30, rtol=1e-15)

    def rate(s):
        left = deepest * s * s * (1 + deepest * (2 - s * s))
        left += 0.8 * stiffness * deepest**2.5 * -np.expm1(2.5 * np.log1p(-s * s))
        return 2 * deepest * s / np.sqrt(left)

    return 2 * quad(rate, 0, 1, epsabs=0, epsrel=1e-11)[0]


@pytest.mark.parametrize("beyond", [1e-2, 1e-4, 1e-6, 1e-7, 1e-8, 1e-9, -1e-12, -1e-6])
def test_grazing_is_not_missed(kernel, beyond):
    """A mass that would turn `beyond` a hard stop comes back earlier, by a known time."""
    values = theta(damping=0.0, amplitude=0.0, force=0.0, right=1e12, left_stop=-5.0)
    out = advance(kernel, [0, STOP + beyond, 0, 0, 0], 1e-12, interval=np.pi, values=values)[0][0]
    early = 0.0
    if beyond > 0:
        early = 2 * np.arctan(np.sqrt(beyond * (1 + beyond)) / STOP) - time_in_contact(beyond, 1e12)
    assert out[0] == pytest.approx(-(STOP + beyond) * np.sin(early), abs=1e-9)


def test_energy_at_any_stiffness_and_without_gap(kernel):
    """Stiff stops lose what the rounding of x hides; without a gap, energy drifts from bounce to bounce."""
    scenes = [(1.0, 0.5, 1e-12), (1e6, 0.5, 1e-11), (1e12, 0.5, 1e-9), (50.0, 0.0, 1e-11), (1e6, 0.0, 1e-9)]
    for stiffness, stop, drift in scenes:
        values = theta(
            damping=0.0, amplitude=0.0, force=0.0, right=stiffness, left=stiffness, right_stop=stop, left_stop=-stop
        )
        states = starts(6, 0.0) * [0.9 if stop else 0.0, 1, 1, 1, 1]
        out, _, status = advance(kernel, states, 1e-13, 5, values=values)
        energy = [
            (z[:, 1] ** 2 + z[:, 0] ** 2) / 2 + 0.4 * stiffness * np.maximum(np.abs(z[:, 0]) - stop, 0) ** 2.5
            for z in (states, out)
        ]
        assert (status == COMPLETED).all()
        assert np.allclose(*energy, rtol=drift, atol=0)


@pytest.mark.slow
def test_law_that_would_pull_is_let_go(clamped):
    """The fine solution agrees with small Runge–Kutta steps of max(law, 0), which lose order at the kinks."""
    states = starts(6, 0.0)
    kernel, values = clamped
    fine, coarse = (
        advance(kernel, states, tolerance, interval=4.0, values=values)[0][:, :2] for tolerance in (1e-13, 1e-9)
    )

    def rates(t, z):
        x, v = z[:, 0], z[:, 1]
        depth = np.maximum(np.abs(x) - STOP, 0.0)
        push = np.maximum(HERTZ * depth**1.5 * (1 + 3 * np.sign(x) * v), 0.0) * np.sign(x)
        return np.column_stack([v, AMPLITUDE * np.cos(FREQUENCY * t) + FORCE - DAMPING * v - STIFFNESS * x - push])

    z, h = states[:, :2], 4.0 / 8000
    for step in range(8000):
        k1 = rates(step * h, z)
        k2 = rates((step + 0.5) * h, z + 0.5 * h * k1)
        k3 = rates((step + 0.5) * h, z + 0.5 * h * k2)
        z = z + h / 6 * (k1 + 2 * k2 + 2 * k3 + rates((step + 1) * h, z + h * k3))
    assert fine == pytest.approx(z, abs=2e-7)
    assert coarse == pytest.approx(fine, abs=1e-7)


@pytest.mark.parametrize("stepper", [vk.Order8(1e-10), vk.FreeFlight(1e-10)], ids=lambda stepper: stepper.name)
@pytest.mark.parametrize("left", [slow(0.3), 0.02, slow(1e-3)])
def test_law_that_pushes_again_before_release(stepper, left):
    """A mass flies out of a stop whose law would pull, is slowed down, and is pushed once more before it leaves.

    The law turns at v = −1/3, at the depth `left`. The reference is SciPy's, with steps that are short against it.
    """
    law = vk.CustomLaw("k*sqrt(depth)*(1 + c*rate)", k=HERTZ, c=3.0)
    start, duration = np.array([left + (1.0 - 1.0 / 9.0) / 2.0, -1.0]), 2.0
    osc = vk.Oscillator(
        natural_frequency=1.0, damping_ratio=0.0, spring=vk.LinearSpring(0.0),
        barriers=(vk.Barrier(law, 0.0, "right"),), excitations=(vk.Constant(1.0),),
    )  # fmt: skip

    def rates(_, q):
        push = max(HERTZ * np.sqrt(max(q[0], 0.0)) * (1.0 + 3.0 * q[1]), 0.0)
        return [q[1], 1.0 - push]

    def turns(_, q):
        return q[1] + 1.0 / 3.0 if q[0] > 0.0 else 1.0

    def touches(_, q):
        return q[0]

    exact = solve_ivp(
        rates, (0.0, duration), start, method="DOP853", rtol=1e-12, atol=1e-14, max_step=1e-4, events=[turns, touches]
    ).y[:, -1]
    found = osc.trajectory(start, duration=duration, samples=2, stepper=stepper)
    assert [found.x[-1], found.v[-1]] == pytest.approx(exact, abs=1e-7)


def test_a_path_passes_through_the_sections(kernel):
    state = starts(1)[0]
    samples = path(kernel, state, 1e-13, PERIOD / 20, 40)
    sections = [advance(kernel, state, 1e-13, k)[0][0] for k in (1, 2)]
    assert samples[[19, 39], :2] == pytest.approx(np.array(sections)[:, :2], abs=1e-10)


def test_intervals_are_memoryless(kernel):
    state = starts(1)[0]
    twice = advance(kernel, advance(kernel, state, 1e-8)[0][0], 1e-8)[0]
    assert (twice == advance(kernel, state, 1e-8, 2)[0]).all()


def test_stops_are_reported(kernel):
    states = starts(2)
    _, done, status = advance(kernel, states, 1e-10, 3, region=np.array([[-1e-9, 1e-9], [-1e-9, 1e-9]]))
    assert (status == LEFT_REGION).all()
    assert (done == 1).all()
    out, done, status = advance(kernel, states, 1e-12, 3, limit=4)
    assert (status == STALLED).all()
    assert (out == states).all()
    states[1, 2:4] = 1e300
    out, done, status = advance(kernel, states, 1e-6, 3, values=theta(damping=60.0))
    assert status[1] == DIVERGED
    assert np.isfinite(out).all()
    assert len(path(kernel, states[1], 1e-6, 1.0, 8, theta(damping=60.0))) < 8
