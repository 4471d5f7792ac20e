"""RKN12: order 12 for all flows that it takes, at any damping; what it cannot integrate is refused."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import vibrokit as vk
from vibrokit.errors import StepperError
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.kernel import kernel_for
from vibrokit.kernels.named import name_of, named_stepper
from vibrokit.kernels.single import record
from vibrokit.symbolic.flow_kind import Flow

PERIOD = 2 * np.pi / 1.4
STARTS = np.random.default_rng(3).uniform(-1.5, 1.5, (40, 2))
NOISES = {"white": vk.WhiteNoise(1e-4), "state-dependent": vk.StateDependentNoise(1e-4, "1 + c*x**2", c=0.3)}
FLOWS = (
    Flow.STATE, Flow.STATE_REVERSED, Flow.STATE_VARIATIONAL, Flow.HAMILTONIAN, Flow.HAMILTONIAN_VARIATIONAL,
)  # fmt: skip


def duffing(damping=0.05, noise="white", spring=None, forced=True):
    return vk.Oscillator(
        natural_frequency=1.0, damping_ratio=damping, spring=spring or vk.CubicSpring(1.0, 0.3), noise=NOISES[noise],
        excitations=(vk.Harmonic(0.4, 1.4), vk.Constant(0.1)) if forced else (),
    )  # fmt: skip


def starts_of(osc, flow):
    """Starts of a flow with an identity for its derivatives."""
    starts = np.zeros((len(STARTS), kernel_for(osc, flow, vk.RK4()).module.EQUATIONS))
    starts[:, :2] = STARTS
    if flow.has_momenta:
        starts[:, 2:4] = np.random.default_rng(4).normal(0.0, 1e-2, STARTS.shape)
    begin, size = {Flow.STATE_VARIATIONAL: (2, 2), Flow.HAMILTONIAN_VARIATIONAL: (5, 4)}.get(flow, (0, 0))
    starts[:, begin : begin + size * size] = np.eye(size).ravel() if size else starts[:, :0]
    return starts


def rates(t, z):
    """Hamilton's equations of the scene, typed by hand."""
    x, v, p1, p2 = z[:4]
    force = 0.4 * np.cos(1.4 * t) + 0.1 - 0.1 * v - x - 0.3 * x**3 + p2
    return v, force, (1 + 0.9 * x**2) * p2, 0.1 * p2 - p1, 0.5 * p2**2


def test_order_12_in_hamiltons_equations():
    starts = starts_of(duffing(), Flow.HAMILTONIAN)
    ends = [solve_ivp(rates, (0, 3 * PERIOD), z, "DOP853", rtol=3e-14, atol=1e-16).y[:, -1] for z in starts]
    steps = np.array([4, 5, 6, 8])

    def error(count):
        found = run_ensemble(duffing(), Flow.HAMILTONIAN, vk.RKN12(count), starts, 3).states
        return np.median(np.linalg.norm(found - ends, axis=1))

    errors = [error(count) for count in steps.tolist()]
    assert -np.polyfit(np.log2(steps), np.log2(errors), 1)[0] == pytest.approx(12, abs=1)
    assert error(24) < 1e-12


CASES = [pytest.param(flow, "white", marks=[pytest.mark.slow] * (flow is FLOWS[-1]), id=flow.value) for flow in FLOWS]
CASES += [pytest.param(Flow.HAMILTONIAN, "state-dependent", id="state-dependent noise")]


@pytest.mark.parametrize(("flow", "noise"), CASES)
def test_flows_agree_with_another_method(flow, noise):
    osc = duffing(noise=noise)
    starts = starts_of(osc, flow)
    ends = run_ensemble(osc, flow, vk.RKN12(24), starts, 1).states
    others = run_ensemble(osc, flow, vk.Order8(1e-14), starts, 1).states
    np.testing.assert_allclose(ends, others, rtol=1e-9, atol=1e-11)


@pytest.mark.parametrize("damping", [0.0, 0.3, 1.0, 2.0])
def test_any_damping_and_no_forcing(damping):
    osc = duffing(damping, forced=False)
    starts = starts_of(osc, Flow.HAMILTONIAN)
    starts[:, 2:4] *= 1e-10 if damping > 1 else 1.0  # momenta grow as states decay
    ends = run_ensemble(osc, Flow.HAMILTONIAN, vk.RKN12(128), starts, 1).states
    others = run_ensemble(osc, Flow.HAMILTONIAN, vk.Order8(1e-14), starts, 1).states
    scale = np.abs(others).max(axis=0)
    assert np.all(np.isfinite(others) & (scale > 0))
    np.testing.assert_allclose(ends / scale, others / scale, atol=1e-10)


def test_recorded_states_are_those_of_the_ensemble():
    recorded = record(duffing(), Flow.STATE, vk.RKN12(12), STARTS[0], 0.0, PERIOD, 3)
    ends = np.array([duffing().section_map(STARTS[:1], periods, stepper=vk.RKN12(12))[0] for periods in (1, 2, 3)])
    np.testing.assert_allclose(recorded[1:], ends, rtol=1e-12)


@pytest.mark.parametrize(
    ("osc", "flow"),
    [
        (duffing(), Flow.NOISY),
        (duffing(), Flow.LINEARISED),
        (duffing(spring=vk.CustomSpring("x + c*x**2*v", c=0.1)), Flow.STATE),
        (vk.load_scene("hertz-0.570"), Flow.STATE),
    ],
    ids=["noise", "covariance", "damping of x^2 v", "stops"],
)
def test_what_it_cannot_integrate_is_refused(osc, flow):
    with pytest.raises(StepperError, match="RKN12"):
        kernel_for(osc, flow, vk.RKN12())


def test_damping_linear_in_the_velocity_is_part_of_a_custom_spring():
    osc = duffing(0.0, spring=vk.CustomSpring("x + b*x**3 + c*v", b=0.3, c=0.1))
    same = duffing(0.05)
    ends = [each.section_map(STARTS, 2, stepper=vk.RKN12(16)) for each in (osc, same)]
    np.testing.assert_allclose(*ends, rtol=1e-12, atol=1e-13)


def test_it_has_a_name():
    assert named_stepper("rkn12:8") == vk.RKN12(8)
    assert name_of(vk.RKN12(8)) == "rkn12:8"
    assert vk.RKN12(8).refined() == vk.RKN12(16)
