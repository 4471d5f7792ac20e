"""Motion that needs too many steps is told apart from motion that diverges, and states that vanish are neither."""

import cmath
import math

import pytest

import vibrokit as vk
from tests.layers import long
from vibrokit.errors import IntegrationError, TooManyStepsError


def frictional(formula, **numbers):
    return vk.Oscillator(natural_frequency=1.0, damping_ratio=0.05, spring=vk.CustomSpring(formula, **numbers))


@pytest.mark.long
@pytest.mark.parametrize(
    "formula",
    ["x + f*atan(v/w)", *map(long, ("x + f*min(max(v/w, -1), 1)", "x + f*tanh(v/w)", "x + f*v/sqrt(v**2 + w**2)"))],
)
def test_friction_that_nearly_jumps_is_named(formula):
    """The force changes by more than f/2 over w = 1e-12 around v = 0."""
    with pytest.raises(TooManyStepsError) as caught:
        frictional(formula, f=0.1, w=1e-12).trajectory((0.05, 0.0), duration=10.0, samples=1)
    assert caught.value.friction
    assert caught.value.time_scale == pytest.approx(1e-11, rel=0.6)
    assert all(map(math.isfinite, caught.value.state))


@pytest.mark.long
@pytest.mark.parametrize(("stiffness", "damping", "tolerance"), [(1e8, 5105.0, 1e-12), (1e9, 2e4, 1e-11)])
def test_rest_on_a_stiff_table_is_followed(stiffness, damping, tolerance):
    """A mass that rests on a shaken table moves as a linear oscillator; rounding where v = 0 leaves no step short."""
    law = vk.CustomLaw("k*depth + c*rate", k=stiffness, c=damping)
    scene = vk.Oscillator(
        natural_frequency=1.0, damping_ratio=0.0, spring=vk.LinearSpring(0.0),
        barriers=(vk.Barrier(law, 0.0, "left"),), excitations=(vk.Constant(-9.8), vk.Harmonic(5.0, 7.0)),
    )  # fmt: skip
    path = scene.trajectory((0.1, 0.0), duration=25.0, samples=4, stepper=vk.Order8(tolerance))
    response = 5.0 * cmath.exp(7j * 25.0) / (stiffness - 49.0 + 7j * damping)
    assert path.x[-1] == pytest.approx(-9.8 / stiffness + response.real, rel=1e-9)
    assert path.v[-1] == pytest.approx((7j * response).real, rel=1e-5)


def test_motion_to_infinity_in_a_finite_time_names_no_force():
    """v′ ≥ v³ reaches infinity before 1/(2 v₀²)."""
    with pytest.raises(IntegrationError) as caught:
        frictional("-v**3").trajectory((2.0, 2.0), duration=10.0, samples=1)
    assert getattr(caught.value, "time_scale", math.inf) == math.inf


@pytest.mark.parametrize("stepper", [vk.Order8(), vk.RK4(steps=64), vk.FreeFlight()])
@pytest.mark.parametrize("start", [1e-300, -3e-310, 5e-324, 0.0])
def test_states_may_vanish(stepper, start):
    """A damped mass is at rest in the end; its numbers pass through denormal ones."""
    end = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.1).trajectory(
        (start, 0.0), duration=50.0, samples=4, stepper=stepper
    )
    assert abs(end.x[-1]) <= max(0.01 * abs(start), 5e-323)  # rounding keeps the least numbers
