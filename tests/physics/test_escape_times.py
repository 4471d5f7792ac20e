"""Mean times of escape, and to and from running states: Kramers' formula with its turn-over, and simulations by NumPy.

The simulations here are a splitting scheme of their own (kick, drift, damping with noise, drift, kick), which shares
nothing with the package.
"""

import functools
import math

import numpy as np
import pytest
from scipy.integrate import quad

import vibrokit as vk
from vibrokit.results.basins import ESCAPED

QUICK = {"cells": (60, 60), "starts": (8, 8), "manifolds": False}


def kramers_time(damping, at_rest, at_top, barrier, temperature, loss):
    """Mean time over one barrier (H. A. Kramers, Physica 7, 284, 1940), with the turn-over to weak damping.

    `damping` is 2ζω_n, and `loss` the energy that damping takes on the way from the barrier back to it or to its
    mirror image (V. I. Mel'nikov & S. V. Meshkov, J. Chem. Phys. 85, 1018, 1986).
    """
    passing = math.sqrt(1 + (damping / (2 * at_top)) ** 2) - damping / (2 * at_top)
    depth = loss / temperature

    def integrand(y):
        return math.log(-math.expm1(-depth * (y * y + 0.25))) / (y * y + 0.25)

    supplied = math.exp(quad(integrand, 0, math.inf)[0] / math.pi)
    return 2 * math.pi / at_rest / passing / supplied * math.exp(barrier / temperature)


def softening(damping_ratio, ratio, sign=1, **more):
    """x²/2 − x³/3, whose only well is left by escape: barrier 1/6, action of the loop at its height 6/5."""
    spring = vk.CustomSpring("x - s*x**2", s=sign)
    return vk.Oscillator(
        natural_frequency=1.0, damping_ratio=damping_ratio, spring=spring,
        noise=vk.WhiteNoise(4 * damping_ratio / 6 / ratio), **more,
    )  # fmt: skip


@functools.cache
def structure_of(osc):
    return vk.find_structure(osc, **QUICK)


def total(analyzer, osc, structure=None, source=0):
    """Mean time of all exits of a state, the largest error of ln rate, and the targets."""
    result = analyzer.run(osc, structure_of(osc) if structure is None else structure)
    rates = [rate for rate in result.rates if rate.source == source]
    return 1 / sum(rate.value for rate in rates), max(rate.log_error for rate in rates), {r.target for r in rates}


def agree(found, right, deviations=3.0, formula=0.0):
    time, error, _ = found
    return abs(math.log(time / right)) <= deviations * error + formula


@pytest.mark.long
@pytest.mark.parametrize("sign", [1, -1])
def test_escape_from_the_only_well_is_that_of_kramers(sign):
    osc = softening(0.1, 6.0, sign)
    right = kramers_time(0.2, 1.0, 1.0, 1 / 6, 1 / 36, 0.2 * 6 / 5)
    for analyzer in (vk.SGCM(intensities=(osc.noise.intensity,)), vk.MFET(intensities=(osc.noise.intensity,))):
        found = total(analyzer, osc)
        assert found[2] == {ESCAPED}
        assert agree(found, right, formula=1 / 6)  # the next order of the formula is that of D/ΔU


@pytest.mark.long
@pytest.mark.parametrize(
    ("damping_ratio", "ratio"),
    [(0.02, 6.0), (0.5, 8.0), (2.0, 6.0)],
)
def test_escape_at_weak_and_strong_damping(damping_ratio, ratio):
    osc = softening(damping_ratio, ratio)
    right = kramers_time(2 * damping_ratio, 1.0, 1.0, 1 / 6, 1 / 6 / ratio, 2 * damping_ratio * 6 / 5)
    for analyzer in (vk.SGCM(intensities=(osc.noise.intensity,)), vk.MFET(intensities=(osc.noise.intensity,))):
        assert agree(total(analyzer, osc), right, formula=1 / ratio)


@pytest.mark.long
def test_two_barriers_are_left_twice_as_often():
    """x²/2 − x⁴/4: from one barrier to the other the action is √8/3."""
    osc = vk.Oscillator(
        natural_frequency=1.0, damping_ratio=0.3, spring=vk.CubicSpring(1.0, -1.0), noise=vk.WhiteNoise(0.05)
    )
    temperature = 0.05 / (4 * 0.3)
    right = 0.5 * kramers_time(0.6, 1.0, math.sqrt(2), 0.25, temperature, 0.6 * math.sqrt(8) / 3)
    for analyzer in (vk.SGCM(intensities=(0.05,)), vk.MFET(intensities=(0.05,))):
        found = total(analyzer, osc)
        assert found[2] == {ESCAPED}
        assert agree(found, right, formula=temperature / 0.25)


def simulated(force, damping, intensity, start, has_left, count=2000, step=0.01, phase=0.0):
    """Mean time until `has_left(x, v)`, from a start, of a NumPy simulation; nine of ten are waited for."""
    rng = np.random.default_rng(3)
    x, v = np.full(count, start[0]), np.full(count, start[1])
    kept, spread = math.exp(-damping * step), math.sqrt(intensity / (2 * damping) * -math.expm1(-2 * damping * step))
    time, at_risk, left = phase, 0.0, 0
    while len(x) > 0.1 * count:
        v = v + 0.5 * step * force(x, time)
        x = x + 0.5 * step * v
        v = kept * v + spread * rng.standard_normal(len(v))
        x = x + 0.5 * step * v
        time += step
        v = v + 0.5 * step * force(x, time)
        at_risk += step * len(x)
        gone = has_left(x, v)
        left += int(gone.sum())
        x, v = x[~gone], v[~gone]
    return at_risk / left


@pytest.mark.slow
@pytest.mark.long
def test_escape_under_a_periodic_force():
    osc = vk.Oscillator(
        natural_frequency=1.0, damping_ratio=0.1, spring=vk.CubicSpring(1.0, -1.0), noise=vk.WhiteNoise(0.02),
        excitations=(vk.Harmonic(0.06, 0.7),),
    )  # fmt: skip
    structure = vk.find_structure(osc, **QUICK)
    right = simulated(
        lambda x, t: -x + x**3 + 0.06 * math.cos(0.7 * t), 0.2, 0.02, structure.attractors[0].points[0],
        lambda x, v: np.abs(x) > 1.8,
    )  # fmt: skip
    for analyzer in (vk.SGCM(intensities=(0.02,)), vk.MFET(intensities=(0.02,), target_error=0.03)):
        assert agree(total(analyzer, osc, structure), right, formula=3 * 1800**-0.5)


@pytest.mark.long
@pytest.mark.parametrize("for_good", [True, False])
def test_two_wells_of_which_one_is_also_left_by_escape(for_good):
    """Wells at 0 and 2, barriers at 1 and 3; density and simulation agree about both ways out of the second."""
    spring = vk.CustomSpring("-x*(x - 1)*(x - 2)*(x - 3)/6")
    osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.2, spring=spring, noise=vk.WhiteNoise(0.016))
    structure = structure_of(osc)
    second = next(one.label for one in structure.attractors if one.points[0, 0] > 1)
    rates = []
    for method in (vk.SGCM, vk.MFET):
        found = method(source=second, intensities=(0.016,), exit=vk.LeaveBasin(for_good=for_good))
        rates.append({rate.target: rate for rate in found.run(osc, structure).rates})
        assert set(rates[-1]) == {1 - second, ESCAPED}
    for target in rates[0]:
        one, other = (each[target] for each in rates)
        assert abs(one.log_value - other.log_value) <= 3 * math.hypot(one.log_error, other.log_error)


@pytest.mark.long
def test_pull_in_has_a_mean_time():
    """The actuator of tests/physics/test_pull_in.py at 450 V."""
    from tests.physics.test_pull_in import actuator, strength

    osc = actuator(450.0)
    structure = vk.find_structure(osc, **QUICK)
    rest, top = structure.attractors[0].points[0, 0], structure.saddles[0].points[0, 0]
    curved = [2e6 - 2 * strength(450.0) / (1.5e-4 - x) ** 3 for x in (rest, top)]

    def potential(x):
        return 1e6 * x**2 - strength(450.0) / (1.5e-4 - x)

    damping, barrier = 2 * 0.1414214 * math.sqrt(2e6), potential(top) - potential(rest)
    low = rest - 1e-5
    while potential(low) < potential(top):
        low -= 1e-7
    action = 2 * quad(lambda x: math.sqrt(2 * max(potential(top) - potential(x), 0.0)), low, top)[0]
    intensity = 2 * damping * barrier / 6
    right = kramers_time(
        damping, math.sqrt(curved[0]), math.sqrt(-curved[1]), barrier, intensity / (2 * damping), damping * action
    )
    for analyzer in (vk.SGCM(intensities=(intensity,)), vk.MFET(intensities=(intensity,))):
        found = total(analyzer, osc, structure)
        assert found[2] == {ESCAPED}
        assert agree(found, right, formula=1 / 6)


WASHBOARDS = {  # β, I, and the right mean time at ΔU/D = 8: StochasticDiffEq.jl issue #519, closed form of Kramers
    "runs": (4.0, 0.9, 9.3643e-4, 8.22e4),
    "rests in the next well": (0.5, 0.9, 0.0599315, 5.09e4),
    "strong tilt": (1.25, 0.9, 0.00958905, 5.98e4),
    "moderate damping": (1.25, 0.7, 0.050356375, 4.12e4),
}


@pytest.mark.long
@pytest.mark.parametrize(("beta", "tilt", "intensity", "right"), WASHBOARDS.values(), ids=WASHBOARDS)
@pytest.mark.parametrize("sign", [1, -1])
def test_the_well_of_a_washboard_is_left(beta, tilt, intensity, right, sign):
    osc = vk.Oscillator(
        natural_frequency=1.0, damping_ratio=0.5 / beta, spring=vk.CustomSpring("sin(x)/b", b=beta),
        excitations=(vk.Constant(sign * tilt / beta),), noise=vk.WhiteNoise(intensity),
    )  # fmt: skip
    structure = vk.find_structure(osc, **QUICK)
    rest = next(one.label for one in structure.attractors if not one.turns)
    for method in (vk.SGCM, vk.MFET):
        found = total(method(source=rest, intensities=(intensity,)), osc, structure, rest)
        assert found[0] == pytest.approx(right, rel=0.2)


def pendulum(damping, *excitations, intensity):
    return vk.Oscillator(
        natural_frequency=1.0, damping_ratio=damping / 2, spring=vk.CustomSpring("sin(x)"), excitations=excitations,
        noise=vk.WhiteNoise(intensity),
    )  # fmt: skip


@pytest.mark.long
def test_a_running_pendulum_comes_to_rest():
    osc = pendulum(0.1, vk.Constant(0.2), intensity=0.04)
    structure = vk.find_structure(osc, **QUICK)
    running = structure.attractor("running")

    def rests(x, v):
        """Below three tenths of the lower barrier, from where hardly any motion runs again."""
        rest, top = math.asin(0.2), math.pi - math.asin(0.2)
        x = x - 2 * math.pi * np.floor((x - top) / (2 * math.pi) + 1)
        energy = 0.5 * v**2 - np.cos(x) - 0.2 * x
        low, high = (-math.cos(place) - 0.2 * place for place in (rest, top))
        return energy < low + 0.3 * (high - low)

    right = simulated(lambda x, t: 0.2 - np.sin(x), 0.1, 0.04, running.points[0, :2], rests)
    # The core is smaller, which takes a relaxation of the energy more, and a visit of it is seen in 0.39 of sections.
    right += 1 / 0.1 + osc.section_interval / 0.39
    for method in (vk.SGCM, vk.MFET):
        found = total(method(source="running", intensities=(0.04,)), osc, structure, running.label)
        assert found[2] == {1 - running.label}
        assert agree(found, right, formula=0.1)


@pytest.mark.long
def test_rotating_states_of_a_forced_pendulum_are_left_alike():
    """They rotate in opposite directions, and are mirror images of each other."""
    osc = pendulum(0.2, vk.Harmonic(1.66, 1.0), intensity=0.006)
    structure = vk.find_structure(osc, **QUICK)
    rotating = [one for one in structure.attractors if one.turns]
    assert len(rotating) == 2
    assert rotating[0].turns == -rotating[1].turns
    for method in (vk.SGCM, vk.MFET):
        times = [total(method(source=one.label, intensities=(0.006,)), osc, structure, one.label) for one in rotating]
        assert abs(math.log(times[0][0] / times[1][0])) <= 3 * math.hypot(times[0][1], times[1][1])
