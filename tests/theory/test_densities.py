"""The formulas of docs/theory/densities.rst, by SymPy."""

import pytest
import sympy as sp

x, v, q = sp.symbols("x v q", real=True)
D, zeta, w, t = sp.symbols("D zeta omega_n t", positive=True)


def fokker_planck(density, drift, diffusion, state):
    """−Σ∂(b ρ) + D/2 Σ∂∂(a ρ)."""
    change = -sum((b * density).diff(z) for b, z in zip(drift, state, strict=True))
    for i, first in enumerate(state):
        for j, second in enumerate(state):
            change += D / 2 * (diffusion[i, j] * density).diff(first, second)
    return change


def test_orders_of_the_wkb_form():
    """ρ = z exp(−Ψ/D), with any drift, a constant diffusion matrix, and functions of time."""
    state = (x, v)
    psi, z = sp.Function("Psi")(x, v, t), sp.Function("z")(x, v, t)
    drift = sp.Function("b1")(x, v, t), sp.Function("b2")(x, v, t)
    a = sp.Matrix([[2, 1], [1, 3]])
    density = z * sp.exp(-psi / D)
    change = sp.expand((fokker_planck(density, drift, a, state) - density.diff(t)) * sp.exp(psi / D))
    change = sp.expand(D * sp.simplify(change))
    slope = sp.Matrix([psi.diff(one) for one in state])
    b = sp.Matrix(drift)
    hamilton = psi.diff(t) + (b.T * slope)[0] + (slope.T * a * slope)[0] / 2
    assert sp.simplify(change.coeff(D, 0) - z * hamilton) == 0
    speed = b + a * slope
    curvature = sp.hessian(psi, state)
    transport = z.diff(t) + sum(speed[i] * z.diff(one) for i, one in enumerate(state))
    transport += (sum(b[i].diff(one) for i, one in enumerate(state)) + (a * curvature).trace() / 2) * z
    assert sp.simplify(change.coeff(D, 1) + transport) == 0


def test_detailed_balance_leaves_no_term_of_the_transport_equation():
    energy = v**2 / 2 + sp.Function("U")(x)
    force = -2 * zeta * w * v - sp.Function("U")(x).diff(x)
    density = sp.exp(-4 * zeta * w * energy / D)
    assert sp.simplify(fokker_planck(density, (v, force), sp.diag(0, 1), (x, v))) == 0
    assert force.diff(v) + (4 * zeta * w * energy).diff(v, 2) / 2 == 0


@pytest.mark.parametrize("amplitude", [1 + q**2 / 3, sp.exp(q / 2)])
def test_the_prefactor_of_noise_that_depends_on_the_state(amplitude):
    """One dimension: ρ = σ⁻² exp(2/D ∫ b/σ²) carries no flux."""
    drift = -q + q**3 / 5
    exponent = sp.Function("F")(q)  # of which the derivative is b/σ²
    density = sp.exp(2 * exponent / D) / amplitude**2
    flux = drift * density - D / 2 * (amplitude**2 * density).diff(q)
    assert sp.simplify(flux.subs(exponent.diff(q), drift / amplitude**2).doit()) == 0
