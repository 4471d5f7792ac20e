"""Motion backwards in time: closed forms, SciPy, and there and back again."""

import ast
import difflib

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from vibrokit_hunt_crossley import HuntCrossley

import vibrokit as vk
from tests.layers import slow
from tests.scenes import Coupled
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.kernel import kernel_for
from vibrokit.structure.manifolds import FlowMap
from vibrokit.symbolic.flow_kind import Flow

FORCES = (vk.Harmonic(amplitude=0.18, frequency=0.57, phase=0.3), vk.Constant(force=0.2))
EXACT = (vk.RK4(4096), vk.Order8(1e-12), vk.FreeFlight(1e-12))
STATES = np.random.default_rng(7).uniform(-0.8, 0.8, (48, 2))


def scene(law=None, adhesive=False, **more):
    stops = [vk.Barrier(law, side * 0.5, name, adhesive) for side, name in ((1, "right"), (-1, "left")) if law]
    settings = {"natural_frequency": 1.0, "damping_ratio": 0.02, "barriers": stops, "excitations": FORCES}
    return vk.Oscillator(**(settings | more))


def preimages(osc, states, periods=1, *, stepper):
    """States of the section mapped backwards in time."""
    return FlowMap(osc, stepper, Flow.STATE_REVERSED, periods, osc.section_interval)(states)


def backwards(acceleration, states, duration):
    """States at the time −duration of the motions that pass through states at time 0, by SciPy."""

    def rates(t, y):
        x, v = y.reshape(2, -1)
        return np.concatenate([v, acceleration(t, x, v)])

    solution = solve_ivp(rates, (0.0, -duration), states.T.ravel(), "DOP853", rtol=3e-14, atol=1e-15)
    return solution.y[:, -1].reshape(2, -1).T


# --- against numbers from elsewhere


@pytest.mark.parametrize("stepper", EXACT, ids=repr)
def test_a_linear_oscillator_goes_back_by_the_exponential_of_its_matrix(stepper):
    osc = scene(damping_ratio=0.3, excitations=(vk.Constant(0.2),))
    matrix = expm(-osc.section_interval * np.array([[0.0, 1.0], [-1.0, -0.6]]))
    found = preimages(osc, STATES, stepper=stepper)
    assert np.abs(found - ([0.2, 0.0] + (STATES - [0.2, 0.0]) @ matrix.T)).max() < 1e-9 * np.abs(found).max()


@pytest.mark.parametrize("stepper", EXACT[:2], ids=repr)
def test_forcing_drag_and_a_spring_that_damps_run_backwards(stepper):
    osc = scene(spring=vk.CustomSpring("a*x + b*x**3 + c*v**3 + d*x**2*v", a=0.8, b=0.3, c=0.05, d=0.1))

    def acceleration(t, x, v):
        spring = 0.8 * x + 0.3 * x**3 + 0.05 * v**3 + 0.1 * x**2 * v
        return 0.18 * np.cos(0.57 * t + 0.3) + 0.2 - 0.04 * v - spring

    starts = 0.3 * STATES  # from farther out the cubic drag leads to infinity before the period is over
    expected = backwards(acceleration, starts, osc.section_interval)
    assert np.abs(preimages(osc, starts, stepper=stepper) - expected).max() < 1e-8 * np.abs(expected).max()


@pytest.mark.slow
def test_a_law_that_would_pull_is_cut_where_it_is_cut_forwards():
    """Strong damping, so that the stop lets go of the mass before it leaves; tested where the way back is bounded."""
    osc = scene(HuntCrossley(50.0, 0.4))

    def acceleration(t, x, v):
        depth, rate = np.maximum(np.abs(x) - 0.5, 0.0), v * np.sign(x)
        push = np.maximum(50.0 * depth**1.5 * (1.0 + 0.6 * rate), 0.0)
        return 0.18 * np.cos(0.57 * t + 0.3) + 0.2 - 0.04 * v - x - np.sign(x) * push

    starts = preimages(osc, STATES, stepper=vk.Order8(1e-8))
    starts = STATES[np.abs(starts).max(axis=1) < 2.0]
    assert len(starts) > 10
    duration = osc.section_interval
    expected = np.concatenate([backwards(acceleration, start[None], duration) for start in starts])
    assert np.abs(preimages(osc, starts, stepper=vk.Order8(1e-11)) - expected).max() < 1e-8


@pytest.mark.slow
def test_states_of_the_noise_run_backwards_too():
    osc = scene(excitations=(), noise=Coupled(intensity=1e-3, rate=0.4))
    matrix = expm(-osc.section_interval * np.array([[0.0, 1.0, 0.0], [-1.0, -0.04, 1.0], [0.0, 0.2, -0.4]]))
    starts = np.random.default_rng(3).uniform(-1.0, 1.0, (20, 3))
    for stepper in EXACT:
        assert np.abs(preimages(osc, starts, stepper=stepper) - starts @ matrix.T).max() < 1e-9


# --- there and back again

LAWS = {
    "hertz": (vk.Hertz(50.0), False, 2.5),
    "linear": (vk.Linear(80.0), False, 2.0),
    "damping": (vk.CustomLaw("k*depth**1.5*(1 + c*rate)", k=50.0, c=0.4), False, 2.5),
    "jumping": (vk.CustomLaw("k*depth + c*rate", k=80.0, c=1.0), False, 1.0),
    "adhesive": (vk.CustomLaw("k*depth + c*rate", k=80.0, c=1.0), True, 1.0),
}


def round_trip(osc, stepper, periods=1):
    """Distances from where motions began to where they come that go back first; of those that go back not too far."""
    earlier = preimages(osc, STATES, periods, stepper=stepper)
    near = np.abs(earlier).max(axis=1) < 2.0
    assert near.sum() > 0.25 * len(STATES)
    ended = run_ensemble(osc, Flow.STATE, stepper, earlier[near], periods)
    return np.linalg.norm(ended.states - STATES[near], axis=1)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["hertz", "linear", "jumping"])
def test_located_contacts(name):
    """A located contact's error is the tolerance, times what motion through stops makes of it: some 1e2 at most."""
    law, adhesive, _ = LAWS[name]
    osc = scene(law, adhesive)
    kind = vk.Order8 if name == "jumping" else vk.FreeFlight
    for tolerance in (1e-8, 1e-11):
        errors = round_trip(osc, kind(tolerance))
        assert np.median(errors) < 100 * tolerance
        assert errors.max() < 1e4 * tolerance  # near grazing


@pytest.mark.parametrize("name", ["hertz", "jumping", *map(slow, ("linear", "damping", "adhesive"))])
def test_fixed_steps_converge_as_they_do_forwards(name):
    law, adhesive, order = LAWS[name]
    osc = scene(law, adhesive)
    coarse, fine = (np.median(round_trip(osc, vk.RK4(steps))) for steps in (1024, 8192))
    assert fine < coarse * 8.0 ** -(order - 0.5)
    assert coarse < (1e-4 if order > 1 else 1e-2)


@pytest.mark.parametrize("name", ["hertz-0.570", "hertz-0.525"])
def test_the_papers_scenes_over_two_periods(name):
    assert np.median(round_trip(vk.load_scene(name), vk.FreeFlight(1e-12), 2)) < 1e-9


def test_any_time_may_be_started_from():
    """From t = 2.1 back to t = 0.8: on the reversed clock, from −2.1 on."""
    osc, stepper, flip = scene(vk.Hertz(50.0)), vk.FreeFlight(1e-12), [1.0, -1.0]
    later = run_ensemble(osc, Flow.STATE, stepper, STATES, start_time=0.8, interval=1.3).states
    back = run_ensemble(osc, Flow.STATE_REVERSED, stepper, later * flip, start_time=-2.1, interval=1.3)
    assert np.abs(back.states * flip - STATES).max() < 1e-8


def test_what_runs_out_of_range_is_nan():
    osc = scene(spring=vk.CustomSpring("x + v**3"), excitations=())
    found = preimages(osc, np.array([[0.1, 0.0], [3.0, 3.0]]), stepper=vk.RK4(256))
    assert np.isfinite(found[0]).all()
    assert np.isnan(found[1]).all()


# --- the code


def code(osc, flow, stepper):
    """Lines of the scene's part of a kernel, docstring and comments apart."""
    return ast.unparse(ast.parse(kernel_for(osc, flow, stepper).source).body[1:]).splitlines()


@pytest.mark.parametrize("stepper", EXACT, ids=repr)
@pytest.mark.parametrize("excitations", [(), FORCES], ids=["unforced", "forced"])
def test_nothing_but_the_signs_of_drag_and_time_differs(stepper, excitations):
    osc = scene(vk.Hertz(50.0), excitations=excitations, noise=vk.WhiteNoise(1e-3))
    pairs = difflib.ndiff(code(osc, Flow.STATE, stepper), code(osc, Flow.STATE_REVERSED, stepper))
    lines = [line for line in pairs if line[0] in "+-"]
    assert {line[0] for line in lines} == {"+", "-"}
    assert all("zeta" in line or "omega * t" in line for line in lines), lines


def test_without_drag_and_forcing_the_way_back_is_the_way():
    osc = vk.load_scene("double-well").replace({"damping_ratio": 0.0})
    assert kernel_for(osc, Flow.STATE, vk.RK4()).scene != kernel_for(osc, Flow.STATE_REVERSED, vk.RK4()).scene
    there = run_ensemble(osc, Flow.STATE, vk.RK4(), STATES).states
    assert np.array_equal(preimages(osc, STATES * [1.0, -1.0], stepper=vk.RK4()) * [1.0, -1.0], there)
