"""Paths near an orbit, continued by the linearized equations, against Hamilton's equations solved by SciPy."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import vibrokit as vk
from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.polishing.linearize import linearized_orbit
from vibrokit.kernels.choice import single_stepper
from vibrokit.symbolic.flow_kind import Flow

DAMPING, STIFFENING, FORCE, RATE = 0.05, 0.3, 0.4, 1.4
OSC = vk.Oscillator(
    natural_frequency=1.0,
    damping_ratio=DAMPING,
    spring=vk.CubicSpring(1.0, STIFFENING),
    excitations=(vk.Harmonic(FORCE, RATE),),
    noise=vk.WhiteNoise(intensity=1e-3),
)
SMALL = 1e-5  # offsets: the equations' error is of second order


@pytest.fixture(scope="module")
def structure():
    return vk.find_structure(OSC, cells=(40, 40), starts=(8, 8), manifolds=False)


@pytest.fixture(scope="module", params=["attractor", "saddle"])
def orbit(request, structure):
    found = structure.attractors[0] if request.param == "attractor" else structure.saddles[0]
    propagator = SegmentPropagator(OSC, single_stepper(OSC, Flow.HAMILTONIAN_VARIATIONAL))
    return linearized_orbit(propagator, found.points[:1], found.period, 0.0)


def rates(t, z):
    """Hamilton's equations of H = p₁ v + p₂ (−2ζv − x − γx³ + F cos ωt) + p₂²/2, by hand."""
    x, v, p1, p2 = z
    force = -2 * DAMPING * v - x - STIFFENING * x**3 + FORCE * np.cos(RATE * t)
    return [v, force + p2, p2 * (1 + 3 * STIFFENING * x**2), -p1 + 2 * DAMPING * p2]


def solved(orbit, point, phase, count):
    piece = orbit.propagator.piece
    times = piece * (phase + np.arange(count + 1))
    return solve_ivp(rates, times[[0, -1]], point, "DOP853", times, rtol=1e-12, atol=1e-14).y.T


def beside(orbit, phase, leaving):
    """A point in the unstable or the stable space."""
    basis = orbit.space_at(phase, leaving=leaving)
    return orbit.point(phase) + SMALL * (basis / np.abs(basis).max(axis=0)) @ [1.0, 0.5]


@pytest.mark.parametrize("phase", [0, 3])
@pytest.mark.parametrize("leaving", [False, True])
def test_what_follows_a_point_in_the_stable_space_or_comes_before_one_in_the_unstable_space(orbit, phase, leaving):
    point, count = beside(orbit, phase, leaving), 11
    more = orbit.continued(point, phase, -count if leaving else count)
    found = np.vstack([more, point] if leaving else [point, more])
    expected = solved(orbit, found[0], phase - count * leaving, count)
    np.testing.assert_allclose(found, expected, atol=50 * SMALL**2)


def test_so_many_nodes_are_missing_to_a_radius(orbit):
    grain = orbit.propagator.grain
    point = beside(orbit, 0, leaving=True)
    radius = 0.01 * SMALL
    added = orbit.missing(point[None], 0, -1, radius, grain)
    points = np.vstack([orbit.continued(point, 0, -added), point])
    distances = np.linalg.norm((points[:, :2] - orbit.along(-added, added + 1))[::grain], axis=1)
    assert added % grain == 0
    assert distances[0] <= radius < distances[1]
    assert orbit.missing(points, -added, -1, radius, grain) == 0
