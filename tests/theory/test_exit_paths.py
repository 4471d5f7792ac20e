"""docs/theory/exit-paths.rst: the attractor is a saddle of the extended space, and how paths leave and arrive."""

import numpy as np
import pytest
import scipy.linalg
import sympy

import vibrokit as vk
from vibrokit.structure.linear_map import gaussian_map

WELL = vk.load_scene("double-well")


def linearized(osc, state):
    """Jacobian of Hamilton's equations at a state with p = 0."""
    model = osc.model
    variables = (*model.state, *model.momenta)
    rates = sympy.Matrix([model.equations[each] for each in variables])
    place = dict(zip(variables, (*state, 0, 0), strict=True))
    return np.array(rates.jacobian(variables).subs(model.numbers).subs(place), dtype=float)


def test_the_plane_without_momenta_is_invariant():
    model = vk.load_scene("hertz-0.570").model
    none = dict.fromkeys(model.momenta, 0)
    assert [model.equations[p].subs(none) for p in model.momenta] == [0, 0]
    assert sympy.simplify(
        sympy.Matrix([model.equations[q].subs(none) for q in model.state]) - model.drift
    ).is_zero_matrix


@pytest.mark.parametrize(("place", "stable"), [(-1.0, 2), (0.0, 1)])
def test_eigenvalues_at_an_equilibrium(place, stable):
    whole = linearized(WELL, (place, 0.0))
    slope = whole[:2, :2]
    np.testing.assert_array_equal(whole[2:, :2], 0)
    np.testing.assert_array_equal(whole[2:, 2:], -slope.T)
    own = np.linalg.eigvals(slope)
    assert (own.real < 0).sum() == stable
    found = np.sort_complex(np.linalg.eigvals(whole))
    np.testing.assert_allclose(found, np.sort_complex(np.concatenate([own, -own])), atol=1e-12)
    assert (found.real > 0).sum() == 2
    exact = np.roots([1, 0.1, 3 * place**2 - 1])  # λ² + 2ζλ + U″
    np.testing.assert_allclose(np.sort_complex(own), np.sort_complex(exact), atol=1e-12)


def test_the_unstable_plane_at_an_equilibrium():
    whole = linearized(WELL, (-1.0, 0.0))
    sigma = scipy.linalg.solve_continuous_lyapunov(whole[:2, :2], -whole[:2, 2:])
    plane = np.vstack([sigma, np.eye(2)])
    np.testing.assert_allclose(whole @ plane, plane @ -whole[:2, :2].T, atol=1e-12)


def test_the_map_is_symplectic_where_the_covariance_is_symmetric():
    m = sympy.Matrix(2, 2, sympy.symbols("m:4"))
    c11, c12, c21, c22 = sympy.symbols("c11 c12 c21 c22")
    c, inverse = sympy.Matrix([[c11, c12], [c21, c22]]), m.inv().T
    zero, one = sympy.zeros(2), sympy.eye(2)
    e = sympy.Matrix(sympy.BlockMatrix([[m, c * inverse], [zero, inverse]]))
    j = sympy.Matrix(sympy.BlockMatrix([[zero, one], [-one, zero]]))
    off = (e.T * j * e - j).applyfunc(sympy.simplify)
    assert off.subs(c21, c12).applyfunc(sympy.simplify).is_zero_matrix
    assert not off.is_zero_matrix


def test_multipliers_of_a_periodic_orbit_and_their_inverses():
    """The forced linear oscillator: μ = exp(λT), M = exp(AT), and Q from Lyapunov's equation."""
    zeta, omega = 0.05, 0.8
    osc = vk.Oscillator(
        natural_frequency=1.0, damping_ratio=zeta, excitations=(vk.Harmonic(0.1, omega),), noise=vk.WhiteNoise(1e-3)
    )
    found = gaussian_map(osc, np.array([[0.1, 0.0]]), vk.RK4(2048))
    m, c = found.derivatives[0], found.covariances[0]
    exact = scipy.linalg.expm(np.array([[0.0, 1.0], [-1.0, -2 * zeta]]) * 2 * np.pi / omega)
    np.testing.assert_allclose(m, exact, atol=1e-9)
    inverse = np.linalg.inv(m).T
    e = np.block([[m, c @ inverse], [np.zeros((2, 2)), inverse]])
    own = np.linalg.eigvals(m)
    np.testing.assert_allclose(
        np.sort_complex(np.linalg.eigvals(e)), np.sort_complex(np.concatenate([own, 1 / own])), atol=1e-9
    )
    sigma = np.eye(2) / (4 * zeta)
    np.testing.assert_allclose(m @ sigma @ m.T + c, sigma, atol=1e-8)
    plane = np.vstack([sigma, np.eye(2)])
    np.testing.assert_allclose(e @ plane, plane @ inverse, atol=1e-8)


@pytest.fixture(scope="module")
def climb():
    states = vk.find_structure(WELL, cells=(60, 60), manifolds=False, rng=0)
    search = vk.LeastAction(source="left-rest", graph=None, shooting=vk.Shooting(points=500))
    (energy,) = search.run(WELL, states).energies
    return energy


def test_an_exit_path_ends_on_the_saddle_without_momentum(climb):
    assert climb.value == pytest.approx(0.05, rel=1e-9)
    size = np.abs(climb.path.p).max(axis=0)
    assert np.all(np.abs(climb.path.p[-1]) < 1e-2 * size)
    assert np.linalg.norm(climb.path.q[-1]) < 1e-2


def test_the_action_grows_and_the_rest_decays_at_the_linear_rates(climb):
    """ΔU − S = 4ζ × the energy that is still to be climbed, ~ exp(−2t|λ|) with λ = −ζ − √(1 + ζ²) reversed."""
    path, zeta = climb.path, 0.05
    rest = climb.value - path.action
    top = 4 * zeta * -(path.q[:, 1] ** 2 / 2 + path.q[:, 0] ** 4 / 4 - path.q[:, 0] ** 2 / 2)
    np.testing.assert_allclose(rest, top, atol=1e-6 * climb.value)
    late = (rest < 1e-3 * climb.value) & (rest > 1e-5 * climb.value)
    slope = np.polyfit(path.t[late], np.log(rest[late]), 1)[0]
    arrival = min(np.sqrt(1 + zeta**2) - zeta, np.sqrt(1 + zeta**2) + zeta)
    assert slope == pytest.approx(-2 * arrival, rel=0.02)
