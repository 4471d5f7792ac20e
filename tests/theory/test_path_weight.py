"""docs/theory/path-weight.rst: the Jacobian of a path, Hamilton's equations, and pushes of given duration."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest
import sympy
from scipy.integrate import solve_ivp

import vibrokit as vk

PICTURES = Path(__file__).parents[2] / "docs" / "images"

t, zeta, omega, k, b, step, D = sympy.symbols("t zeta omega_n k b Delta D", positive=True)
x = sympy.Function("x")(t)
X, V = sympy.symbols("x v", real=True)


def test_euler_s_method_has_the_same_jacobian_for_all_paths():
    f, count = sympy.Function("f"), 4
    v = sympy.symbols(f"v0:{count + 1}")
    place, noise = sympy.Symbol("x0"), []
    for n in range(count):
        noise.append((v[n + 1] - v[n]) / step - f(place, v[n]))
        place = place + v[n] * step
    assert sympy.simplify(sympy.Matrix(noise).jacobian(v[1:]).det() - step**-count) == 0


def test_midpoint_rule_has_the_jacobian_of_onsager_and_machlup():
    """Linear damping: det · Δⁿ = (1 + ζω_nΔ)ⁿ → exp(ζω_n τ), and −½ ∂f/∂v = ζω_n."""
    count = 4
    v = sympy.symbols(f"v0:{count + 1}")
    noise = [(v[n + 1] - v[n]) / step + 2 * zeta * omega * (v[n] + v[n + 1]) / 2 for n in range(count)]
    det = sympy.Matrix(noise).jacobian(v[1:]).det()
    assert sympy.simplify(det * step**count - (1 + zeta * omega * step) ** count) == 0
    n, duration = sympy.symbols("n tau", positive=True)
    limit = sympy.limit((1 + zeta * omega * duration / n) ** n, n, sympy.oo)
    assert sympy.simplify(limit - sympy.exp(zeta * omega * duration)) == 0


def test_hamiltonian_is_the_logarithm_of_a_mean():
    w, drift, sigma, p = sympy.symbols("w drift sigma p", real=True)
    root = sympy.sqrt(2 * sympy.pi * step)
    weight = sympy.exp(-(w**2) / (2 * step)) / root
    mean = sympy.integrate(sympy.exp(p * sigma * w / sympy.sqrt(D)) * weight, (w, -sympy.oo, sympy.oo))
    exponent = p * drift * step / D + sympy.log(sympy.simplify(mean))
    wanted = (p * drift + sigma**2 * p**2 / 2) * step / D
    assert sympy.simplify(sympy.expand_log(exponent - wanted, force=True)) == 0


def hamilton_s_fourth_order(force):
    """The equation for x that remains of Hamilton's equations when v, p₂ and p₁ are eliminated in this order."""
    v = sympy.diff(x, t)
    along = {X: x, V: v}
    noise = sympy.diff(v, t) - force.subs(along, simultaneous=True).doit()
    slope_x, slope_v = (sympy.diff(force, q).subs(along, simultaneous=True).doit() for q in (X, V))
    p1 = -noise * slope_v - sympy.diff(noise, t)  # from p₂′
    return sympy.diff(p1, t) + noise * slope_x  # p₁′ = −p₂ ∂f/∂x


def euler_lagrange(force):
    """∂L/∂x − d/dt ∂L/∂x′ + d²/dt² ∂L/∂x″ of L = ½ (x″ − f)²."""
    acceleration = sympy.Symbol("acceleration")
    lagrangian = (acceleration - force) ** 2 / 2
    along = {X: x, V: sympy.diff(x, t), acceleration: sympy.diff(x, t, 2)}
    by_x, by_v, by_a = (sympy.diff(lagrangian, q).subs(along, simultaneous=True).doit() for q in (X, V, acceleration))
    return by_x - sympy.diff(by_v, t) + sympy.diff(by_a, t, 2)


SMOOTH = {
    "one stop": -2 * zeta * omega * V - omega**2 * X - k * (X - b) ** sympy.Rational(3, 2) + sympy.cos(t),
    "nonlinear damping": -X + X**3 - V * X**2 - V**3,
}


@pytest.mark.parametrize("force", SMOOTH.values(), ids=SMOOTH)
def test_euler_lagrange_is_hamilton_s_equation_of_fourth_order(force):
    difference = sympy.expand(euler_lagrange(force) + hamilton_s_fourth_order(force))
    assert sympy.simplify(difference) == 0
    assert euler_lagrange(force).has(sympy.Derivative(x, (t, 4)))


OSC = vk.Oscillator(
    natural_frequency=1.0,
    damping_ratio=0.05,
    barriers=(vk.Barrier(vk.Hertz(stiffness=50.0), position=0.5, side="right"),),
    excitations=(vk.Harmonic(amplitude=0.1, frequency=0.8),),
    noise=vk.WhiteNoise(intensity=1e-3),
)


@pytest.mark.parametrize("touching", [False, True])
def test_equations_of_the_page_are_those_that_osc_derives(touching):
    model = OSC.model
    (q1, q2), (m1, m2), sym = model.state, model.momenta, model.symbols
    w, z, place = sym["natural_frequency"], sym["damping_ratio"], sym["barriers.0.position"]
    depth = q1 - place if touching else sympy.Integer(0)
    hertz = sym["barriers.0.law.stiffness"]
    wanted = {
        q1: q2,
        q2: -2 * z * w * q2 - w**2 * q1 - hertz * depth ** sympy.Rational(3, 2) + model.forcing + m2,
        m1: (w**2 + sympy.Rational(3, 2) * hertz * sympy.sqrt(depth)) * m2,
        m2: -m1 + 2 * z * w * m2,
    }
    for variable, rate in model.equations.items():
        chosen = rate.replace(lambda e: isinstance(e, sympy.Piecewise), lambda e: e.args[0 if touching else 1][0])
        assert sympy.simplify(chosen - wanted[variable]) == 0, variable
    assert sympy.simplify(model.hamiltonian - (m1 * model.drift[0] + m2 * model.drift[1] + m2**2 / 2)) == 0


def test_the_momentum_that_the_paper_prints_lacks_a_term():
    """(19) prints 2ζω_n p₂; with −p₂′ added it is p₁ of the fourth of Hamilton's equations."""
    rate = OSC.model.equations
    _, m2 = OSC.model.momenta
    w, z = OSC.model.symbols["natural_frequency"], OSC.model.symbols["damping_ratio"]
    m1 = OSC.model.momenta[0]
    assert sympy.simplify(2 * z * w * m2 - rate[m2] - m1) == 0
    assert sympy.simplify(2 * z * w * m2 - m1) != 0


@pytest.fixture(scope="module")
def picture():
    spec = importlib.util.spec_from_file_location("theory_path_durations", PICTURES / "theory_path_durations.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("turns", [0.25, 1, 3])
def test_pushes_of_given_duration_solve_hamilton_s_equations(picture, turns):
    osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=picture.ZETA, noise=vk.WhiteNoise(1e-3))
    model = osc.model
    variables = (*model.state, *model.momenta)
    equations = [model.equations[each] for each in variables] + [model.action_rate]
    rate = sympy.lambdify([variables], sympy.Matrix(equations).subs(model.numbers))
    duration = turns * picture.TURN
    last = np.linalg.solve(picture.covariance(duration), [1.0, 0.0])
    first = picture.expm(picture.SLOPE.T * duration) @ last
    ended = solve_ivp(
        lambda _, y: np.asarray(rate(y[:4]), dtype=float).ravel(),
        (0, duration),
        [0, 0, *first, 0],
        rtol=1e-11,
        atol=1e-13,
    ).y[:, -1]
    np.testing.assert_allclose(ended[:2], [1.0, 0.0], atol=1e-9)
    assert ended[4] == pytest.approx(picture.least_action(duration), rel=1e-8)


def test_pushes_of_long_duration_cost_the_quasi_potential(picture):
    assert picture.least_action(60 * picture.TURN) == pytest.approx(2 * picture.ZETA, rel=1e-12)
    costs = [picture.least_action(turns * picture.TURN) for turns in (0.25, 0.5, 1, 2, 4, 8)]
    assert costs == sorted(costs, reverse=True)
