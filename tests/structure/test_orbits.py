"""Orbits at one node and at several: multipliers of products, states between nodes, Newton's method."""

import itertools
import math

import numpy as np
import pytest

import vibrokit as vk
from tests.scenes import scene
from vibrokit.structure.orbits import (
    Orbit,
    least_period,
    multipliers_of,
    nodes_from,
    refine_orbit,
    states_along,
    visited,
)

ORDER8 = vk.Order8(tolerance=1e-12)
DUFFING = scene(
    damping_ratio=0.05,
    spring=vk.CubicSpring(linear=1.0, cubic=0.3),
    excitations=(vk.Harmonic(amplitude=0.4, frequency=1.4),),
)


def turned_steps(rates, count):
    """Steps whose product has the eigenvalues exp(count · rate): in a basis that turns once around meanwhile."""
    angles = 2 * math.pi * np.arange(count + 1) / count
    bases = np.array([[[math.cos(a), -2 * math.sin(a)], [math.sin(a), 2 * math.cos(a)]] for a in angles])
    scaled = np.diag(np.exp(rates))
    return np.array([after @ scaled @ np.linalg.inv(before) for before, after in itertools.pairwise(bases)])


@pytest.mark.parametrize("count", [1, 8, 64])
def test_multipliers_of_any_size(count):
    """In doubles, the product of 64 steps would lose the small eigenvalue below 1e-16 of the large one."""
    rates = np.array([4.0, -5.0])
    orbit = Orbit(np.zeros((count, 2)), 1, 3.0, turned_steps(rates, count), 0.0)
    found = orbit.multipliers.real
    np.testing.assert_allclose(np.log(found[np.argsort(-found)]), count * rates, rtol=1e-12)
    np.testing.assert_allclose(sorted(orbit.exponents.real), sorted(count * rates / 3.0), rtol=1e-12)


def test_multipliers_beyond_the_largest_number():
    orbit = Orbit(np.zeros((100, 2)), 1, 100.0, turned_steps(np.array([8.0, -9.0]), 100), 0.0)
    assert sorted(np.abs(orbit.multipliers)) == [0.0, np.finfo(float).max]
    rounding = np.finfo(float).eps * math.exp(8.0 + 9.0)  # of the small eigenvalue of one step
    np.testing.assert_allclose(sorted(orbit.exponents.real), [-9.0, 8.0], rtol=rounding)
    direction = orbit.unstable_direction
    assert abs(direction[1]) <= 1e-12 * abs(direction[0])


def test_pairs_of_complex_multipliers():
    turn = np.array([[math.cos(0.3), -math.sin(0.3)], [math.sin(0.3), math.cos(0.3)]])
    found = multipliers_of(np.array([0.9 * turn] * 5))
    np.testing.assert_allclose(sorted(found, key=np.imag), 0.9**5 * np.exp([-1.5j, 1.5j]), rtol=1e-12)


@pytest.mark.parametrize("pieces", [2, 8])
def test_several_nodes_are_the_orbit_of_one(pieces):
    one = refine_orbit(DUFFING, np.array([-0.35, 0.0]), 1, ORDER8)
    nodes = states_along(DUFFING, one.nodes, 1, ORDER8, pieces)
    several = refine_orbit(DUFFING, nodes + 1e-3, 1, ORDER8)
    np.testing.assert_allclose(several.nodes, nodes, atol=1e-9)
    np.testing.assert_allclose(several.monodromy, one.monodromy, atol=1e-9)
    np.testing.assert_allclose(np.sort_complex(several.multipliers), np.sort_complex(one.multipliers), atol=1e-9)
    assert math.log(abs(np.prod(several.multipliers))) == pytest.approx(-0.1 * one.duration, rel=1e-9)
    np.testing.assert_allclose(states_along(DUFFING, several.nodes, 1, ORDER8, 1), one.nodes, atol=1e-9)
    # As an orbit of period 2 it has the same points, and its least period is 1.
    twice = refine_orbit(DUFFING, np.concatenate([nodes, nodes]), 2, ORDER8)
    np.testing.assert_allclose(visited(DUFFING, twice, ORDER8), np.tile(one.point, (2, 1)), atol=1e-9)
    assert least_period(DUFFING, twice, ORDER8).period == 1
    later = nodes_from(1, twice.nodes, visited(DUFFING, twice, ORDER8))
    np.testing.assert_allclose(later, several.nodes[np.arange(2 * pieces) % pieces], atol=1e-9)
