"""Motion ends at poles and where formulas end, with every stepper, and bounces back from poles that repel."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import vibrokit as vk
from tests.layers import slow
from tests.scenes import scene
from vibrokit.errors import IntegrationError
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.stopping import COMPLETED, DIVERGED
from vibrokit.structure.linear_map import gaussian_map, hamiltonian_map
from vibrokit.symbolic.flow_kind import Flow

STEPPERS = [vk.RK4(256), vk.RK4(8), vk.Order8(1e-6), vk.Order8(1e-10)]
LOCATED = [vk.Order8(1e-6), vk.Order8(1e-10)]
PULL, GAP = 0.3, 0.8


def named(stepper):
    return repr(stepper)


def attracted(side=1.0, **more):
    """A mass that falls to a pole at ± GAP: x″ = ± PULL/(GAP ∓ x)²."""
    formula = "-a/(g - x)**2" if side > 0 else "a/(g + x)**2"
    return scene(damping_ratio=0.0, spring=vk.CustomSpring(formula, a=PULL, g=GAP), **more)


def fall(distance):
    """Time of a fall from rest to the centre of Kepler's problem: a quarter of π √(2 r³/a)."""
    return 0.25 * math.pi * np.sqrt(2 * distance**3 / PULL)


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("stepper", STEPPERS, ids=named)
def test_a_fall_to_a_pole_ends_when_it_arrives(stepper, side):
    with pytest.raises(IntegrationError, match="pole of the forces") as caught:
        attracted(side).trajectory((0.2 * side, 0.0), duration=9.0, stepper=stepper)
    coarse = 2 * math.pi / 256 if isinstance(stepper, vk.RK4) else 1e-3
    assert caught.value.time == pytest.approx(fall(GAP - 0.2), abs=2 * coarse)
    assert f"{side * GAP:g}" in str(caught.value)


@pytest.mark.parametrize("stepper", LOCATED, ids=named)
def test_the_time_of_a_located_end(stepper):
    with pytest.raises(IntegrationError) as caught:
        attracted().trajectory((0.2, 0.0), duration=9.0, stepper=stepper)
    assert caught.value.time == pytest.approx(fall(GAP - 0.2), rel=1e-5)


@pytest.mark.parametrize("stepper", STEPPERS, ids=named)
def test_ensembles_end_at_a_pole_without_a_warning(stepper):
    starts = np.stack([np.linspace(-2.0, 0.79, 50), np.zeros(50)], axis=1)
    ended = run_ensemble(attracted(), Flow.STATE, stepper, starts, 20)
    assert (ended.status == DIVERGED).all()
    late = np.floor(fall(GAP - starts[:, 0]) / (2 * math.pi))
    assert np.abs(ended.intervals - late).max() <= 1
    assert (ended.states[:, 0] < GAP).all()


def test_noise_does_not_carry_a_walker_across():
    osc = attracted(noise=vk.WhiteNoise(5.0))
    starts = np.zeros((256, 2))
    for _ in range(8):
        ended = run_ensemble(
            osc,
            Flow.NOISY,
            vk.RK4(64),
            starts,
            1,
            streams=np.random.default_rng(0).integers(2**60, size=(256, 4), dtype=np.uint64),
        )
        alive = ended.status == COMPLETED
        assert (ended.states[alive, 0] < GAP).all()
        starts = np.where(alive[:, None], ended.states, 0.0)
    with pytest.raises(IntegrationError, match="pole"):
        osc.trajectory((0.7, 0.0), duration=9.0, rng=1)


@pytest.mark.parametrize("stepper", [None, *LOCATED], ids=named)
def test_motion_bounces_back_from_a_pole_that_repels(stepper):
    """x″ = a/x³ has the solution x² = (x₀ + v₀ t)² + a t²/x₀²."""
    osc, time = scene(damping_ratio=0.0, spring=vk.CustomSpring("-a/x**3", a=1e-3)), 2 * math.pi
    start, speed = np.meshgrid(np.linspace(0.5, 4.0, 12), np.linspace(-4.0, 1.0, 12))
    starts = np.stack([start.ravel(), speed.ravel()], axis=1)
    starts = np.concatenate([starts, -starts])
    x, v = starts.T
    exact = np.sign(x) * np.sqrt((x + v * time) ** 2 + 1e-3 * (time / x) ** 2)
    np.testing.assert_allclose(osc.section_map(starts, stepper=stepper)[:, 0], exact, rtol=2e-3)


@pytest.mark.parametrize(
    ("formula", "start", "place"),
    [
        ("-3*sqrt(1 - x**2)", (0.2, 0.3), 1.0),
        ("0.5*tan(x) - 2", (0.1, 0.0), None),
        ("log(x)/10 + 1", (2.0, -1.0), 0.0),
        ("x**-1.5", (2.0, 0.5), 0.0),
        ("-0.3/(1 - x)", (0.2, 0.3), 1.0),
        ("x + 1/(2 - v)", (0.0, 1.9), None),
    ],
)
def test_where_and_when_as_scipy_has_it(formula, start, place):
    osc = scene(damping_ratio=0.02, spring=vk.CustomSpring(formula))
    names = {name: getattr(np, name) for name in ("sqrt", "tan", "log")}
    if place is None:  # a pole that repels the mass, or that it does not reach
        path = osc.trajectory(start, duration=4.0)
        exact = integrated(formula, names, start, 4.0)
        assert path.x[-1] == pytest.approx(exact.y[0, -1], abs=1e-7)
        return
    with pytest.raises(IntegrationError) as caught:
        osc.trajectory(start, duration=40.0)
    edge = 1e-9 * (1 if start[0] > place else -1)
    exact = integrated(formula, names, start, 40.0, lambda t, y: y[0] - place - edge)
    assert caught.value.time == pytest.approx(exact.t_events[0][0], abs=2e-4)
    assert f"x = {place:g}" in str(caught.value)


def integrated(formula, names, start, duration, event=None):
    def rates(t, y):
        return [y[1], -0.04 * y[1] - eval(formula, names, {"x": y[0], "v": y[1]})]

    if event is not None:
        event.terminal = True
    with np.errstate(all="ignore"):
        return solve_ivp(rates, (0.0, duration), start, "DOP853", events=event, rtol=1e-10, atol=1e-12)


def test_a_stop_that_cannot_be_pressed_flat():
    """A law with a pole: a slow mass is thrown back, a fast one comes as near to the pole as numbers can."""
    stop = vk.Barrier(vk.CustomLaw("k*depth/(1 - depth/full)", k=10.0, full=0.1), 0.5, "right")
    osc = scene(stop, damping_ratio=0.05)
    slow = osc.trajectory((0.0, 0.6), periods=1)
    assert 0.5 < slow.x.max() < 0.6
    with pytest.raises(IntegrationError, match="pole"):
        osc.trajectory((0.0, 30.0), periods=1)
    assert run_ensemble(osc, Flow.STATE, vk.Order8(1e-8), np.array([[0.0, 30.0]]), 3).status == [DIVERGED]


def test_section_maps_name_the_pole():
    with pytest.raises(IntegrationError, match=r"1 of 2 trajectories ended.*pole") as caught:
        scene(damping_ratio=0.1, spring=vk.CustomSpring("x - 0.05/(1 - x)**2")).section_map([[0.0, 0.0], [0.9, 0.0]], 3)
    assert caught.value.state == (0.9, 0.0)


@pytest.mark.parametrize("stepper", [vk.RK4(64), vk.Order8(1e-10)], ids=named)
@pytest.mark.parametrize("amplitude", ["sqrt(c - x**2)", slow("sqrt(c - x**2)*exp(x/9)")])
def test_noise_has_no_covariance_and_no_action_where_it_is_not_real(stepper, amplitude):
    osc = scene(noise=vk.StateDependentNoise(1e-3, amplitude, c=0.5))
    inside, beyond, out = [0.1, 0.1], [1.2, 0.0], [0.5, 3.0]  # out: it crosses the edge within the time
    found = gaussian_map(osc, np.array([inside, beyond, out]), stepper, interval=0.3)
    assert np.isfinite(found.covariances[0]).all()
    assert (np.linalg.eigvalsh(found.covariances[0]) > 0).all()
    assert np.isnan(found.covariances[1:]).all()
    moved = hamiltonian_map(osc, np.array([[*q, 0.1, 0.1] for q in (inside, beyond, out)]), stepper, interval=0.3)
    assert moved.actions[0] > 0
    assert np.isnan(moved.actions[1:]).all()


@pytest.mark.parametrize(
    ("formula", "start", "border"),
    [
        ("log(1 + x)", (-1.0, 0.0), "x = -1"), ("log(1 + x)", (-2.0, 0.5), "x = -2"),
        ("x/sqrt(9 - x**2)", (3.5, 0.0), "x = 3.5"), ("x - 0.1/(1 - x)**2", (1.0, 0.3), "x = 1,"),
        ("x*sqrt(abs(v) - 1)", (1.0, 0.5), "v = 0.5"),
    ],
)  # fmt: skip
def test_a_start_where_the_forces_have_no_value_is_refused(formula, start, border):
    osc = scene(spring=vk.CustomSpring(formula))
    for moved in (lambda: osc.trajectory(start, duration=1.0), lambda: osc.section_map([start])):
        with pytest.raises(IntegrationError, match="the forces") as caught:
            moved()
        assert caught.value.time == 0.0
        assert border in str(caught.value)


@pytest.mark.parametrize("formula", ["x + b**1.5", "x*b**n"])
def test_a_formula_without_a_real_value(formula):
    spring = vk.CustomSpring(
        formula, **{name: value for name, value in {"b": -2.0, "n": 0.25}.items() if name in formula}
    )
    with pytest.raises(IntegrationError, match="no value"):
        scene(spring=spring).trajectory((0.1, 0.2), periods=1)
