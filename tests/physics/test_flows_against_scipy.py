"""Flows against SciPy's DOP853 with every contact located: a right-hand side written by hand, another integrator."""

import concurrent.futures
import math
import multiprocessing

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import vibrokit as vk
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.symbolic.flow_kind import Flow

STARTS, PERIODS = 30, 10
OMEGA, STOP, STIFFNESS = 0.57, 0.5, 50.0
FINEST = [vk.FreeFlight(tolerance=1e-14), vk.Order8(tolerance=1e-14)]


def right_hand_side(t, z, side):
    """x, v, p₁, p₂, S with the stop of one side pushing, or none."""
    x, v, p1, p2, _ = z
    depth = max(side * x - STOP, 0.0) if side else 0.0
    push = -side * STIFFNESS * depth**1.5
    force = 0.18 * math.cos(OMEGA * t) + 0.2 - x - 0.02 * v + push
    return [v, force + p2, (1 + 1.5 * STIFFNESS * math.sqrt(depth)) * p2, 0.02 * p2 - p1, 0.5 * p2 * p2]


def touch(side):
    def event(t, z, *_):
        return side * z[0] - STOP

    event.terminal = True
    return event


def reference(start, periods):
    """Integrate from contact to contact, each located to rounding and restarted from."""
    events = [touch(side) for side in (1, -1)]
    t, end, z = 0.0, periods * 2 * math.pi / OMEGA, np.array(start)
    side = next((s for s in (1, -1) if s * z[0] > STOP), 0)
    while t < end:
        watched = events if side == 0 else [events[(1 - side) // 2]]
        for event in watched:
            event.direction = 1.0 if side == 0 else -1.0
        found = solve_ivp(right_hand_side, (t, end), z, "DOP853", args=(side,), rtol=1e-13, atol=1e-15, events=watched)
        t, z = found.t[-1], found.y[:, -1]
        if found.status == 1:
            hit = next(i for i, times in enumerate(found.t_events) if len(times))
            side = (1, -1)[hit] if side == 0 else 0
    return z


def starts():
    rng = np.random.default_rng(0)
    z = np.zeros((STARTS, 5))
    z[:, :2] = rng.uniform(-0.6, 0.6, (STARTS, 2))
    return z


def spread(states, periods):
    context = multiprocessing.get_context("spawn")
    with concurrent.futures.ProcessPoolExecutor(mp_context=context) as pool:
        return np.array(list(pool.map(reference, states, [periods] * len(states), chunksize=10)))


def starts_with_momenta():
    states = starts()
    states[:, 2:4] = np.random.default_rng(1).normal(0, 1e-3, (STARTS, 2))
    return states


@pytest.fixture(scope="module")
def long_reference():
    return spread(starts(), PERIODS)


@pytest.fixture(scope="module")
def reference_with_momenta():
    return spread(starts_with_momenta(), 2)


@pytest.mark.long
@pytest.mark.parametrize("stepper", FINEST, ids=lambda s: s.name)
def test_state_over_ten_periods(stepper, long_reference):
    osc = vk.load_scene("hertz-0.570")
    ends = osc.section_map(starts()[:, :2], PERIODS, stepper=stepper)
    errors = np.linalg.norm(ends - long_reference[:, :2], axis=1)
    print(f"{stepper}: median {np.median(errors):.1e}, 90 % {np.quantile(errors, 0.9):.1e}, worst {errors.max():.1e}")
    assert np.median(errors) <= 1e-10


@pytest.mark.slow
@pytest.mark.parametrize("stepper", FINEST, ids=lambda s: s.name)
def test_momenta_and_action(stepper, reference_with_momenta):
    osc, exact = vk.load_scene("hertz-0.570"), reference_with_momenta
    ends = run_ensemble(osc, Flow.HAMILTONIAN, stepper, starts_with_momenta(), 2).states
    scale = np.abs(exact)
    scale[:, 2:4] = np.linalg.norm(exact[:, 2:4], axis=1, keepdims=True)
    scale[:, :2] = 1.0
    errors = (np.abs(ends - exact) / scale).max(axis=1)
    print(f"{stepper}: median {np.median(errors):.1e}, worst {errors.max():.1e}")
    assert np.median(errors) <= 1e-10
