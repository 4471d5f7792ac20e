"""Derivatives of motion where the slope of a force is infinite, against SciPy, which stops at each crossing."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import vibrokit as vk
from tests.layers import long
from vibrokit.errors import DerivationError, StepperError
from vibrokit.kernels.choice import LOCATED, ensemble_stepper
from vibrokit.structure.linear_map import hamiltonian_map, linear_map
from vibrokit.symbolic.flow_kind import Flow

PERIOD = 2 * math.pi / 0.8
STARTS = np.array([[-0.48, 0.9], [0.1, 0.63], [0.3, -0.87], [-0.9, 0.2]])


def forced(**parts):
    return vk.Oscillator(
        natural_frequency=1.0, damping_ratio=0.05, excitations=(vk.Harmonic(0.6, 0.8),), **parts
    )  # fmt: skip


def stopped(formula, **parameters):
    return forced(barriers=(vk.Barrier(vk.CustomLaw(formula, **parameters), 0.5, "right"),))


def end(start, force, place):
    """Where a start leads in one period under a force of x, x′ and the side of a place; DOP853 between crossings."""
    time, state, side = 0.0, np.array(start), 1 if start[0] > place else -1
    while time < PERIOD - 1e-14:

        def crossing(t, y):
            return y[0] - place

        crossing.terminal, crossing.direction = True, -side

        def rates(t, y, side=side):
            x = place + side * max(side * (y[0] - place), 0.0)
            return [y[1], 0.6 * math.cos(0.8 * t) - 0.1 * y[1] - force(x, y[1], side)]

        path = solve_ivp(
            rates, (time, PERIOD), state, method="DOP853", rtol=1e-13, atol=1e-15, events=crossing, first_step=1e-9
        )  # fmt: skip
        time, state = path.t[-1], path.y[:, -1]
        if path.status == 1:
            state[0], side = place, -side
    return state


def derivative(start, force, place, step=1e-5):
    sides = [end(start + step * unit, force, place) - end(start - step * unit, force, place) for unit in np.eye(2)]
    return np.array(sides).T / (2 * step)


def contact(push):
    return lambda x, v, side: x + (push(x - 0.5, v) if side > 0 else 0.0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("osc", "force", "place"),
    [
        (stopped("k*depth**n", k=5.0, n=0.6), contact(lambda d, r: 5 * d**0.6), 0.5),
        long(stopped("5*depth**0.5"), contact(lambda d, r: 5 * math.sqrt(d)), 0.5),
        long(stopped("50*depth**0.95"), contact(lambda d, r: 50 * d**0.95), 0.5),
        long(stopped("5*log(1 + depth)**0.5"), contact(lambda d, r: 5 * math.sqrt(math.log1p(d))), 0.5),
        long(stopped("5*depth**0.6*(1 + 0.3*rate)"), contact(lambda d, r: 5 * d**0.6 * (1 + 0.3 * r)), 0.5),
        (stopped("5*depth**0.25"), contact(lambda d, r: 5 * d**0.25), 0.5),
        (
            stopped("k*depth**1.5 + c*depth**0.25*rate", k=50.0, c=1.4),
            contact(lambda d, r: max(0.0, 50 * d**1.5 + 1.4 * d**0.25 * r)),
            0.5,
        ),
        (
            forced(spring=vk.CustomSpring("sign(x)*abs(x)**p", p=0.5)),
            lambda x, v, side: side * math.sqrt(abs(x)),
            0.0,
        ),
        long(
            forced(spring=vk.CustomSpring("x + 0.5*sqrt(abs(x - 0.2))")),
            lambda x, v, side: x + 0.5 * math.sqrt(abs(x - 0.2)),
            0.2,
        ),
    ],
)
def test_derivatives_across_an_infinite_slope(osc, force, place):
    found = linear_map(osc, STARTS, vk.Order8(1e-10))
    for start, image, matrix in zip(STARTS, found.images, found.derivatives, strict=True):
        np.testing.assert_allclose(image, end(start, force, place), atol=1e-8)
        np.testing.assert_allclose(matrix, derivative(start, force, place), atol=2e-5)


@pytest.mark.parametrize(
    "formula",
    [
        "sign(x)", "x + 0.3*sign(x)*v", "x + atan(1/(x - 1))", "sign(x)*abs(x)**0.2", "x + abs(x - 0.3)**n",
        "x + k*sign(x)", "x + sign(v)*abs(v)**0.3",
    ],
)  # fmt: skip
def test_derivatives_across_a_jump_or_a_steeper_slope_are_refused(formula):
    parameters = {"n": 0.4, "k": 0.0}
    spring = vk.CustomSpring(formula, **{name: value for name, value in parameters.items() if name in formula})
    osc = forced(spring=spring)
    osc.model.drift  # noqa: B018 - the motion itself can be followed
    with pytest.raises(DerivationError, match="derivatives of the motion"):
        osc.model.check_derivatives()


@pytest.mark.parametrize(
    "formula",
    [
        "x + abs(x)", "x*abs(x)", "x + max(x - 1, 0)", "x + sqrt(abs(x))", "x + v*abs(v)", "x*log(abs(x))", "x/(3 - x)",
        "x + (x + 2)**0.2", "x*(1 - 1/sqrt(1 + x**2))", "sin(x)/x",
    ],
)  # fmt: skip
def test_derivatives_under_other_forces_are_not(formula):
    forced(spring=vk.CustomSpring(formula)).model.check_derivatives()


def test_motion_under_a_jump_is_right_by_default():
    """RK4(256) was off by 6e-2 in this period; a structure, which needs derivatives, is refused."""
    osc = forced(spring=vk.CustomSpring("sign(x)"))
    assert ensemble_stepper(osc, Flow.STATE) == LOCATED
    ends = [end(start, lambda x, v, side: side, 0.0) for start in STARTS]
    np.testing.assert_allclose(osc.section_map(STARTS), ends, atol=1e-4)
    with pytest.raises(DerivationError, match="stops with a constant law"):
        vk.find_structure(osc)


@pytest.mark.parametrize("formula", ["depth**1.5 + depth**0.25*rate", "depth + depth**0.9"])
def test_derivatives_of_momenta_end_at_the_touch_of_a_steep_stop(formula):
    """They diverge there. Before it they are those without the stop."""
    stops = (vk.Barrier(vk.CustomLaw(formula), 0.5, "right"),)
    starts = np.array([[-0.4, -0.2, 0.01, 0.02], [0.4, 0.5, 0.01, 0.02]])
    found, right = (
        hamiltonian_map(forced(noise=vk.WhiteNoise(1e-3), **parts), starts, vk.Order8(1e-10), interval=0.5)
        for parts in ({"barriers": stops}, {})
    )
    np.testing.assert_allclose(found.derivatives[0], right.derivatives[0], atol=1e-9)
    assert np.isnan(found.derivatives[1]).all()
    assert np.isnan(found.images[1]).all()


def test_derivatives_of_momenta_are_refused_under_a_steep_spring():
    osc = forced(noise=vk.WhiteNoise(1e-3), spring=vk.CustomSpring("sign(x)*sqrt(abs(x))"))
    with pytest.raises(StepperError, match="SGCM or MFET"):
        hamiltonian_map(osc, np.zeros((1, 4)), vk.Order8())


def test_fixed_steps_refuse_derivatives_across_an_infinite_slope():
    for osc in (stopped("5*depth**0.5"), forced(spring=vk.CustomSpring("sign(x)*sqrt(abs(x))"))):
        with pytest.raises(StepperError, match="slope of a force is infinite"):
            linear_map(osc, STARTS, vk.RK4(1024))
