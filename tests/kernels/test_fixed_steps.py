"""RK4 and RK8: their orders where forces are smooth, and across contacts the order that the force leaves."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import vibrokit as vk
from vibrokit.errors import StepperError
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.kernel import kernel_for
from vibrokit.kernels.single import record
from vibrokit.symbolic.flow_kind import Flow

DUFFING = vk.Oscillator(
    natural_frequency=1.0, damping_ratio=0.05, spring=vk.CubicSpring(1.0, 0.3),
    excitations=(vk.Harmonic(0.4, 1.4),), noise=vk.WhiteNoise(intensity=1e-4),
)  # fmt: skip
PERIOD = 2 * np.pi / 1.4
STARTS = np.random.default_rng(3).uniform(-1.5, 1.5, (40, 2))


def rates(t, z):
    x, v, p1, p2 = z[:4]
    force = 0.4 * np.cos(1.4 * t) - 0.1 * v - x - 0.3 * x**3 + p2
    return v, force, (1 + 0.9 * x**2) * p2, 0.1 * p2 - p1, 0.5 * p2**2


def reference(starts, end):
    """SciPy's DOP853 on equations typed by hand."""
    ends = [solve_ivp(rates, (0, end), start, "DOP853", rtol=3e-14, atol=1e-16).y[:, -1] for start in starts]
    return np.array(ends)


@pytest.fixture(scope="module")
def extremals():
    """Starts (x, v, p, action) and where Hamilton's equations lead in three periods."""
    momenta = np.random.default_rng(4).normal(0.0, 1e-2, STARTS.shape)
    starts = np.hstack([STARTS, momenta, np.zeros((len(STARTS), 1))])
    return starts, reference(starts, 3 * PERIOD)


@pytest.mark.parametrize(
    ("kind", "steps", "order", "least"), [(vk.RK4, (128, 256, 512), 4.0, 1e-8), (vk.RK8, (12, 24, 48), 8.5, 1e-11)]
)
def test_order_in_hamiltons_equations(extremals, kind, steps, order, least):
    starts, ends = extremals

    def error(count):
        found = run_ensemble(DUFFING, Flow.HAMILTONIAN, kind(count), starts, 3).states
        return np.median(np.linalg.norm(found - ends, axis=1))

    errors = [error(count) for count in steps]
    assert errors[-1] < least
    np.testing.assert_allclose(-np.diff(np.log2(errors)), order, atol=order / 8)


@pytest.mark.slow
def test_derivatives_are_those_of_the_flow():
    """Of many equations, whose stages are computed in another way."""
    module = kernel_for(DUFFING, Flow.HAMILTONIAN_VARIATIONAL, vk.RK8(64)).module
    start = np.zeros((1, module.EQUATIONS))
    start[0, :4] = 0.4, -0.2, 1e-2, -2e-2
    one = run_ensemble(DUFFING, Flow.HAMILTONIAN_VARIATIONAL, vk.RK8(64), start, 1).states
    other = run_ensemble(DUFFING, Flow.HAMILTONIAN_VARIATIONAL, vk.Order8(1e-13), start, 1).states
    np.testing.assert_allclose(one, other, rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("stepper", [vk.RK4(40), vk.RK8(40)], ids=repr)
def test_recorded_states_are_those_of_the_ensemble(stepper):
    recorded = record(DUFFING, Flow.STATE, stepper, STARTS[0], 0.0, PERIOD, 3)
    ends = np.array([DUFFING.section_map(STARTS[:1], periods, stepper=stepper)[0] for periods in (1, 2, 3)])
    np.testing.assert_allclose(recorded[1:], ends, rtol=1e-12)  # the forcing of later periods is rounded differently


@pytest.mark.parametrize(("power", "error"), [(0.5, 2.2e-5), (1.5, 4.5e-9), (3.0, 2.2e-12)])
def test_the_power_of_the_depth_at_first_touch_sets_the_order_of_rk4(power, error):
    osc = vk.Oscillator(
        natural_frequency=1.0, damping_ratio=0.05, excitations=(vk.Harmonic(0.6, 0.8),),
        barriers=(vk.Barrier(vk.CustomLaw("k*depth**n", k=20.0, n=power), 0.5, "right"),),
    )  # fmt: skip
    starts = np.random.default_rng(0).uniform(-1, 1, (1000, 2))
    fine = osc.section_map(starts, stepper=vk.Order8(1e-13))
    coarse, small = (
        np.median(np.abs(osc.section_map(starts, stepper=vk.RK4(steps)) - fine).max(axis=1)) for steps in (512, 8192)
    )
    assert np.log2(coarse / small) / 4 == pytest.approx(min(1 + power, 4.0), abs=0.1)
    assert small == pytest.approx(error, rel=0.1)


def test_noise_is_refused():
    with pytest.raises(StepperError, match="RK4"):
        DUFFING.section_map(STARTS, stepper=vk.RK8(32), rng=0)


@pytest.mark.parametrize("steps", [0, -3, 1.5, True, 10**8])
def test_numbers_of_steps_that_are_refused(steps):
    with pytest.raises(StepperError, match="RK4: steps"):
        vk.RK4(steps)
