"""A stop whose force jumps at first touch: derivatives of the motion jump too, and fixed steps refuse them."""

import math

import numpy as np
import pytest

import vibrokit as vk
from tests.scenes import scene
from vibrokit.errors import DerivationError, StepperError
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.structure.linear_map import linear_map
from vibrokit.symbolic.flow_kind import Flow

LOCATED = [vk.FreeFlight(tolerance=1e-13), vk.Order8(tolerance=1e-13)]


def kelvin_voigt(adhesive=False, noise=None):
    law = vk.KelvinVoigt(stiffness=200.0, damping=3.0)
    return scene(
        vk.Barrier(law, 0.5, "right", adhesive),
        vk.Barrier(law, -0.5, "left", adhesive),
        excitations=(vk.Harmonic(0.18, 0.57), vk.Constant(0.2)),
        noise=noise,
    )


@pytest.mark.slow
@pytest.mark.parametrize(("stepper", "adhesive"), list(zip(LOCATED, [False, True], strict=True)), ids=str)
def test_derivatives_are_those_of_the_map(stepper, adhesive):
    osc = kelvin_voigt(adhesive)
    start = np.array([0.3, 0.5])
    (derivative,) = linear_map(osc, start[None], stepper).derivatives
    step = 1e-5
    moved = start + step * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])
    images = osc.section_map(moved, 1, stepper=stepper)
    differences = np.column_stack([images[0] - images[1], images[2] - images[3]]) / (2 * step)
    np.testing.assert_allclose(derivative, differences, atol=1e-6 * np.abs(differences).max())


@pytest.mark.slow
@pytest.mark.parametrize("stepper", LOCATED, ids=lambda s: s.name)
def test_one_adhesive_bounce_in_closed_form(stepper):
    """Inside an adhesive Kelvin–Voigt stop at 0 the motion is linear: it leaves after half a damped period."""
    k, c = 200.0, 3.0
    osc = scene(vk.Barrier(vk.KelvinVoigt(k, c), 0.0, "right", adhesive=True), damping_ratio=0.0)
    damped = math.sqrt(1 + k - c**2 / 4)
    inside = math.pi / damped
    speed = 0.7 * math.exp(-c / 2 * inside)
    path = osc.trajectory([0.0, 0.7], duration=inside + math.pi / 2, samples=1, stepper=stepper)
    np.testing.assert_allclose(path.states[-1], [-speed, 0.0], atol=1e-11)


@pytest.mark.slow
def test_steady_states_are_found():
    structure = vk.find_structure(kelvin_voigt(), cells=(30, 30))
    assert all(attractor.residual < 1e-9 for attractor in structure.attractors)


def test_fixed_steps_refuse_derivatives():
    with pytest.raises(StepperError, match="FreeFlight or Order8"):
        linear_map(kelvin_voigt(), np.array([[0.3, 0.5]]), vk.RK4())


@pytest.mark.parametrize("formula", ["1/depth", "-log(depth)"])
def test_a_force_without_bound_is_refused(formula):
    osc = scene(vk.Barrier(vk.CustomLaw(formula), 0.0, "right"))
    with pytest.raises(DerivationError, match="unbounded at first touch"):
        osc.trajectory((0.0, 0.5), duration=1.0)


def test_fixed_steps_refuse_momenta_with_the_reason():
    osc = kelvin_voigt(noise=vk.WhiteNoise(1e-5))
    with pytest.raises(StepperError, match=r"jumps at first touch.*FreeFlight or Order8"):
        run_ensemble(osc, Flow.HAMILTONIAN, vk.RK4(), np.array([[0.3, 0.5, 0.0, 0.1, 0.0]]))
