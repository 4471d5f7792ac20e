"""Parametric excitation: Mathieu's equation, and the parametron."""

import functools
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import vibrokit as vk
from vibrokit.analyzers.paths.mirror import Mirror
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.assessment.plausibility import Measure
from vibrokit.errors import NoSectionError, StepperError
from vibrokit.parts.functions import cos
from vibrokit.structure.orbits import refine_orbit


class Damping(vk.Excitation):
    """Damping that varies: −c cos(πt) v."""

    rate: float = vk.parameter("c", "s^-1")
    period = 2.0

    def force(self, t, x, v):
        return -self.rate * cos(math.pi * t) * v


SHARP = vk.Order8(1e-13)


def mathieu(damping, depth, frequency=2.0, phase=0.0, **more):
    """x″ + γx′ + (1 − λ cos(ωt + φ)) x = 0."""
    part = vk.ParametricStiffness(stiffness=-depth, frequency=frequency, phase=phase)
    return vk.Oscillator(natural_frequency=1.0, damping_ratio=damping / 2, excitations=(part,), **more)


def parametron(**more):
    """The flat state is unstable. A force of no size makes two periods of the stiffness the section interval."""
    osc = mathieu(0.1, 0.6, spring=vk.CubicSpring(linear=1.0, cubic=1.0), noise=vk.WhiteNoise(1e-3))
    return osc.replace(excitations=(*osc.excitations, vk.Harmonic(amplitude=0.0, frequency=1.0)), **more)


def multipliers(osc):
    """Of the motion about x = 0."""
    return np.sort_complex(refine_orbit(osc, np.zeros((1, 2)), 1, SHARP).multipliers)


@pytest.mark.parametrize(
    ("damping", "depth", "frequency", "phase"), [(0.1, 0.15, 2.0, 0.0), (0.1, 0.6, 2.0, 0.7), (0.02, 1.3, 0.9, 2.0)]
)
def test_multipliers_are_those_of_mathieu_s_equation(damping, depth, frequency, phase):
    def rate(t, flat):
        (x, v), stiffness = flat.reshape(2, 2), 1 - depth * math.cos(frequency * t + phase)
        return np.concatenate([v, -damping * v - stiffness * x])

    span = (0.0, 2 * math.pi / frequency)
    solved = solve_ivp(rate, span, np.eye(2).ravel(), method="DOP853", rtol=1e-12, atol=1e-14)
    wanted = np.sort_complex(np.linalg.eigvals(solved.y[:, -1].reshape(2, 2)).astype(complex))
    np.testing.assert_allclose(multipliers(mathieu(damping, depth, frequency, phase)), wanted, rtol=0, atol=1e-8)


def test_rest_loses_its_stability_where_the_depth_is_twice_the_damping():
    """The threshold of the first tongue is λ = 2γ, up to terms of higher order (Nayfeh & Mook, chapter 5)."""

    def threshold(damping):
        def excess(depth):
            return -1.0 - multipliers(mathieu(damping, depth)).real.min()

        return brentq(excess, 1.5 * damping, 3.0 * damping, xtol=1e-12)

    departures = [abs(threshold(damping) / damping - 2.0) for damping in (0.2, 0.1, 0.05)]
    assert departures[0] > 3 * departures[1] > 9 * departures[2]
    assert departures[2] < 0.05**2


@pytest.mark.parametrize("stepper", [vk.Order8(1e-12), vk.RK4(4096), vk.RK8(512)], ids=lambda one: one.name)
def test_stiffness_beside_a_force_as_an_independent_integration(stepper):
    """Also backwards in time, where the table of the functions of time is another one."""
    osc = parametron().replace({"excitations.1.amplitude": 0.2, "excitations.0.phase": 0.3}, noise=None)

    def rate(t, state):
        x, v = state
        return v, -0.1 * v - (1 - 0.6 * math.cos(2 * t + 0.3)) * x - x**3 + 0.2 * math.cos(t)

    wanted = solve_ivp(rate, (0, 6 * math.pi), [0.3, 0.1], method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
    found = osc.trajectory([0.3, 0.1], periods=3, stepper=stepper).states[-1]
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-9)


def test_a_varying_stiffness_is_no_motion_at_rest():
    """It has no detailed balance, does not relax, and is undamped only where nothing depends on the velocity."""
    still = mathieu(0.1, 0.0).replace(excitations=())
    assert still.model.relaxes
    assert not mathieu(0.1, 0.1).model.relaxes
    assert mathieu(0.1, 0.1, noise=vk.WhiteNoise(1e-3)).model.balance is None
    assert mathieu(0.0, 0.1).model.undamped
    assert not mathieu(0.0, 0.1).autonomous

    assert not mathieu(0.0, 0.0).replace(excitations=(Damping(0.1),)).model.undamped


def test_two_periods():
    one, two = vk.ParametricStiffness(0.1, 2.0), vk.ParametricStiffness(0.1, 3.0)
    assert mathieu(0.1, 0.1).replace(excitations=(one, two)).period == pytest.approx(2 * math.pi)
    with pytest.raises(NoSectionError, match="no common period"):
        _ = mathieu(0.1, 0.1).replace(excitations=(one, vk.Harmonic(0.1, math.sqrt(2)))).period


def test_exact_flight_is_refused():
    with pytest.raises(StepperError, match=r"constant coefficients.*kappa\*x\*cos.*use Order8 or RK4"):
        mathieu(0.1, 0.1).section_map([[0.1, 0.0]], stepper=vk.FreeFlight())


def test_the_free_scene_of_a_parametron_is_told_without_an_amplitude():
    """Its mean stiffness has a natural frequency, but no linear response is that of a constant system."""
    told = vk.plausibility(parametron())
    assert told.value(Measure.NATURAL_RAD) == pytest.approx(1.0)
    assert math.isnan(told.value(Measure.AMPLITUDE))
    assert math.isnan(told.value(Measure.NOISE_RMS))


@functools.cache
def phases():
    osc = parametron()
    return osc, vk.find_structure(osc, cells=(60, 60), starts=(8, 8), manifolds=False)


@pytest.mark.slow
def test_a_parametron_has_two_phases():
    """They are each the negative of the other, and half a section interval later they have changed places."""
    osc, structure = phases()
    one, other = structure.attractors
    np.testing.assert_allclose(one.points, -other.points, atol=1e-9)
    later = osc.trajectory(one.points[0], duration=math.pi).states[-1]
    np.testing.assert_allclose(later, other.points[0], atol=1e-8)
    halved = osc.replace(excitations=osc.excitations[:1])
    (single,) = vk.find_structure(halved, cells=(60, 60), starts=(8, 8), manifolds=False).attractors
    assert single.period == 2
    # The orbits are one curve, so that only the time tells which is the image.
    assert [Mirror(ExitProblem(osc, structure, each, vk.LeaveBasin())).image for each in (one, other)] == [1, 0]


@pytest.mark.slow
@pytest.mark.long
def test_both_phases_of_a_parametron_cost_the_same():
    osc, structure = phases()
    least = vk.LeastAction(graph=None, shooting=vk.Shooting(points=1000, rounds=6))
    found = [vk.LeastAction(source=k, graph=None, shooting=least.shooting).run(osc, structure) for k in (0, 1)]
    first, second = (result.energies[0] for result in found)
    assert first.certificate is not None
    assert second.value == pytest.approx(first.value, rel=1e-8)
    image = least.run(osc, structure)
    assert image.found(vk.Code.MIRROR_IMAGE)
    assert [one.value for one in image.energies] == pytest.approx([first.value, first.value], rel=1e-8)
