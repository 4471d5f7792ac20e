"""docs/theory/quasi-potential.rst: Hamilton–Jacobi's and Lyapunov's equations, detailed balance, three wells."""

import pytest
import sympy

import vibrokit as vk

x, v, gamma = sympy.symbols("x v gamma", real=True)
zeta, omega, D = sympy.symbols("zeta omega_n D", positive=True)
U = sympy.Function("U")(x)
ENERGY = v**2 / 2 + U


def hamilton_jacobi(psi, force, amplitude=1):
    """v Ψ_x + f Ψ_v + ½ σ² Ψ_v²"""
    by_v = sympy.diff(psi, v)
    return sympy.expand(v * sympy.diff(psi, x) + force * by_v + amplitude**2 * by_v**2 / 2)


def test_quadratic_form_of_the_linear_oscillator():
    slope = sympy.Matrix([[0, 1], [-(omega**2), -2 * zeta * omega]])
    sigma = sympy.diag(1 / (4 * zeta * omega**3), 1 / (4 * zeta * omega))
    assert (slope * sigma + sigma * slope.T + sympy.diag(0, 1)).applyfunc(sympy.simplify).is_zero_matrix
    place = sympy.Matrix([x, v])
    psi = (place.T * sigma.inv() * place)[0] / 2
    assert hamilton_jacobi(psi, -(omega**2) * x - 2 * zeta * omega * v) == 0
    c = sympy.Symbol("c", positive=True)
    (best,) = sympy.solve(sympy.diff(psi.subs(x, c), v), v)
    assert sympy.simplify(psi.subs(x, c).subs(v, best) - 2 * zeta * omega**3 * c**2) == 0


def test_lyapunov_s_equation_follows_from_the_quadratic_form():
    slope = sympy.Matrix(2, 2, sympy.symbols("a:4"))
    s11, s12, s22 = sympy.symbols("s11 s12 s22")
    sigma, noise = sympy.Matrix([[s11, s12], [s12, s22]]), sympy.diag(0, 1)
    stiffness = sigma.inv()
    form = stiffness * slope + slope.T * stiffness + stiffness * noise * stiffness
    lyapunov = slope * sigma + sigma * slope.T + noise
    assert (sigma * form * sigma - lyapunov).applyfunc(sympy.simplify).is_zero_matrix


def test_detailed_balance_solves_the_equation():
    force = -2 * zeta * omega * v - sympy.diff(U, x)
    left = hamilton_jacobi(gamma * ENERGY, force)
    assert sympy.simplify(left - gamma * v**2 * (gamma / 2 - 2 * zeta * omega)) == 0
    assert sympy.solve(left, gamma) == [0, 4 * zeta * omega]


def test_the_square_that_bounds_every_path():
    rate = sympy.Symbol("rate")
    slope, friction = sympy.diff(U, x), 2 * zeta * omega * v
    cost, reversed_cost = (rate + slope + friction) ** 2 / 2, (rate + slope - friction) ** 2 / 2
    assert sympy.expand(cost - reversed_cost - 4 * zeta * omega * v * (rate + slope)) == 0


def test_boltzmann_s_density_is_stationary():
    density = sympy.exp(-4 * zeta * omega * ENERGY / D)
    force = -2 * zeta * omega * v - sympy.diff(U, x)
    change = -sympy.diff(v * density, x) - sympy.diff(force * density, v) + D / 2 * sympy.diff(density, v, 2)
    assert sympy.simplify(change) == 0


def test_damping_that_depends_on_the_energy():
    ratio = sympy.Function("zeta")
    force = -2 * ratio(ENERGY) * omega * v - sympy.diff(U, x)
    by_x, by_v = sympy.diff(U, x) * 4 * ratio(ENERGY) * omega, v * 4 * ratio(ENERGY) * omega  # Ψ′(E) = 4 ζ(E) ω_n
    assert sympy.simplify(v * by_x + force * by_v + by_v**2 / 2) == 0


@pytest.mark.parametrize(
    ("damping", "amplitude", "holds"),
    [
        (2 * zeta * omega * v, 1, True),
        (2 * zeta * omega * v * (1 + x**2), sympy.sqrt(1 + x**2), True),  # in proportion to σ²
        (2 * zeta * omega * v * (1 + x**2), 1, False),
        (2 * zeta * omega * v, 1 + x**2, False),
        (v**3, 1, False),
    ],
)
def test_where_the_formula_holds(damping, amplitude, holds):
    left = hamilton_jacobi(gamma * ENERGY, -damping - sympy.diff(U, x), amplitude)
    factor = sympy.solve(left, gamma)
    constant = [each for each in factor if each != 0 and not each.free_symbols & {x, v}]
    assert bool(constant) is holds


WELLS = {
    "double": (vk.CubicSpring(linear=-1.0, cubic=1.0), (), 1 / 4),
    "cubic": (vk.CustomSpring("x - x**2"), (), 1 / 6),
    "Hertz": (
        vk.CustomSpring("-x"),
        (vk.Barrier(vk.Hertz(50.0), 0.36, "right"), vk.Barrier(vk.Hertz(50.0), -0.36, "left")),
        0.4**2 / 2 - 2 / 5 * 50 * 0.04**2.5,
    ),
}


@pytest.mark.parametrize(
    ("spring", "stops", "barrier"),
    [pytest.param(*well, id=name, marks=[pytest.mark.slow] * (name == "Hertz")) for name, well in WELLS.items()],
)
def test_wells_by_hand(spring, stops, barrier):
    scene = vk.Oscillator(
        natural_frequency=1.0, damping_ratio=0.05, spring=spring, barriers=stops, noise=vk.WhiteNoise(1e-3)
    )
    found = vk.find_structure(scene, cells=(60, 60), manifolds=False, rng=0)
    few = vk.Shooting(points=500)
    (energy, *_) = vk.LeastAction(source=0, graph=None, shooting=few).run(scene, found).energies
    assert energy.value == pytest.approx(0.2 * barrier, rel=1e-8)
    assert energy.lower <= 0.2 * barrier * (1 + 1e-9)


def test_the_mass_that_rests_in_a_hertz_stop():
    x0, depth = sympy.Rational(4, 10), sympy.Rational(4, 100)
    assert 50 * depth ** sympy.Rational(3, 2) == x0
    barrier = x0**2 / 2 - sympy.Rational(2, 5) * 50 * depth ** sympy.Rational(5, 2)
    assert barrier == sympy.Rational(736, 10000)
