"""Limit cycles that attract so weakly that motion nearly repeats long before it is on one."""

import numpy as np
import pytest

import vibrokit as vk


def averaged(al, be):
    """Amplitudes of the stable cycles to first order in mu: 1 − A²/4 + al A⁴/8 − 5 be A⁶/64 falls to 0."""
    squares = np.roots([-5 * be / 64, al / 8, -1 / 4, 1.0])
    found = sorted(square.real for square in squares if abs(square.imag) < 1e-12 and square.real > 0)
    slope = np.polyder([-5 * be / 64, al / 8, -1 / 4, 1.0])
    return [np.sqrt(square) for square in found if np.polyval(slope, square) < 0]


def amplitudes(formula, starts=(8, 8), frequency=1.0, **values):
    """Of all attractors that are found."""
    osc = vk.Oscillator(
        natural_frequency=frequency, damping_ratio=0.0, spring=vk.CustomSpring(formula, w2=frequency**2, **values)
    )
    found = vk.find_structure(osc, cells=(10, 10), starts=starts, saddles=False)
    assert {one.kind for one in found.attractors} == {"limit cycle"}
    return sorted(float(np.ptp(one.orbit[:, 0])) / 2 for one in found.attractors)


BIRHYTHMIC = "w2*x - mu*(1 - x**2 + al*x**4 - be*x**6)*v"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mu", "al", "be", "starts"),
    [
        # A turn takes 2π(1 + 2e-7), so that motion nearly repeats after 2π.
        pytest.param(0.002, 0.083, 0.0014, (24, 24), marks=pytest.mark.long),
        (0.002, 0.144, 0.005, (10, 10)),
        (0.0005, 0.144, 0.005, (10, 10)),  # the cycle between these has the multiplier 1.0013
    ],
)
def test_weak_cycles_count_once_each(mu, al, be, starts):
    assert amplitudes(BIRHYTHMIC, starts, mu=mu, al=al, be=be) == pytest.approx(averaged(al, be), rel=1e-4)


def test_a_weak_cycle_of_van_der_pol_counts_once():
    """Its amplitude is 2 + mu²/96; the units are those of a scene at 100 rad/s."""
    found = amplitudes("w2*x - mu*(1 - x**2)*v", starts=(6, 6), frequency=100.0, mu=0.5)
    assert found == pytest.approx([2.0], rel=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("formula", "damping"),
    [
        ("x - mu*(1 - x**2)*v", 0.0),  # the multiplier of the cycle is exp(−2π mu)
        ("x - mu*(1 - x**2 + 0.01*x**4)*v", 0.0),
        ("mu*x/10 + mu*x**3", 0.05),  # x falls at the rate 0.1 mu/0.1, far more slowly than by the damping
    ],
)
def test_cells_are_followed_as_long_as_the_slowest_deviation_takes(formula, damping):
    osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=damping, spring=vk.CustomSpring(formula, mu=0.002))
    found = vk.find_structure(osc, region=((-3.0, 3.0), (-3.0, 3.0)), cells=(20, 20), starts=(6, 6), saddles=False)
    (only,) = found.attractors
    assert found.budget > 2000
    assert only.basin_fraction == 1.0
