"""A linear oscillator that touches nothing: its steady state, multipliers and covariance are known in closed form."""

import cmath
import math

import numpy as np
import pytest

import vibrokit as vk
from tests.layers import slow
from vibrokit.analyzers.paths.local_potential import local_potential
from vibrokit.structure.orbits import refine_orbit

STEPPERS = [vk.RK4(steps=8192), vk.RK8(steps=256), vk.Order8(tolerance=1e-14), vk.FreeFlight(tolerance=1e-14)]


def linear_scene(damping, natural=1.0, amplitude=0.1, frequency=0.57, constant=0.05):
    return vk.Oscillator(
        natural_frequency=natural,
        damping_ratio=damping,
        barriers=(vk.Barrier(vk.Hertz(50.0), 5.0, "right"),),
        excitations=(vk.Harmonic(amplitude, frequency), vk.Constant(constant)),
        noise=vk.WhiteNoise(1e-4),
    )


def steady_state(damping, natural=1.0, amplitude=0.1, frequency=0.57, constant=0.05):
    """State at t = 0 of x = Re(X exp(iωt)) + constant/ω_n²."""
    response = amplitude / (natural**2 - frequency**2 + 2j * damping * natural * frequency)
    return np.array([response.real + constant / natural**2, (1j * frequency * response).real])


def multipliers(damping, natural=1.0, frequency=0.57):
    root = cmath.sqrt(damping**2 - 1)
    both = (cmath.exp(natural * (-damping + sign * root) * 2 * math.pi / frequency) for sign in (1, -1))
    return sorted(both, key=in_order)


def in_order(number):
    return number.real, number.imag


@pytest.mark.parametrize("stepper", STEPPERS, ids=lambda s: s.name)
@pytest.mark.parametrize("damping", [0.01, slow(0.3), 1.0, slow(2.0)])
def test_steady_state_and_multipliers(stepper, damping):
    osc = linear_scene(damping)
    exact = steady_state(damping)
    orbit = refine_orbit(osc, exact + np.array([1e-3, -2e-3]), 1, stepper)
    np.testing.assert_allclose(orbit.point, exact, rtol=0, atol=1e-12)
    found = np.linalg.eigvals(orbit.monodromy)
    wanted = multipliers(damping)
    if damping == 1.0:  # a double eigenvalue: its split is the root of the rounding error, its sum is not
        found, wanted = [found.sum(), found.prod()], [sum(wanted), wanted[0] * wanted[1]]
    else:
        found = sorted(found, key=in_order)
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-12)


@pytest.mark.parametrize("stepper", STEPPERS, ids=lambda s: s.name)
def test_resonance_without_damping_grows_as_in_the_closed_form(stepper):
    osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.0, excitations=(vk.Harmonic(0.1, 1.0),))
    # x″ + x = f cos t from rest: x = f t sin t / 2.
    t = 10 * 2 * math.pi
    state = osc.section_map([[0.0, 0.0]], 10, stepper=stepper)[0]
    exact = [0.05 * t * math.sin(t), 0.05 * (math.sin(t) + t * math.cos(t))]
    np.testing.assert_allclose(state, exact, atol=2e-11)


@pytest.mark.parametrize("damping", [0.01, 0.3, 2.0])
def test_covariance_of_the_quasi_potential(damping):
    natural = 1.3
    osc = linear_scene(damping, natural)
    orbit = refine_orbit(osc, steady_state(damping, natural), 1, vk.RK4(4096))
    covariance = local_potential(osc, orbit, vk.RK4(4096)).covariance
    exact = np.diag([1 / (4 * damping * natural**3), 1 / (4 * damping * natural)])
    np.testing.assert_allclose(covariance, exact, rtol=1e-8, atol=1e-8 * exact[0, 0])


def test_noisy_moments_are_those_of_the_closed_form():
    damping, intensity, count = 0.05, 1e-2, 40_000
    osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=damping, noise=vk.WhiteNoise(intensity))
    states = osc.section_map(np.zeros((count, 2)), 30, rng=7, stepper=vk.RK4(64))
    sigma = intensity / (4 * damping)
    spread = math.sqrt(2 / count) * sigma
    assert abs(states[:, 0].var() - sigma) < 5 * spread
    assert abs(states[:, 1].var() - sigma) < 5 * spread
    assert abs(np.mean(states[:, 0] * states[:, 1])) < 5 * sigma / math.sqrt(count)
