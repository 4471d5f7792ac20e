"""The formulas of docs/theory/rates.rst, by SymPy and against the exact spectrum of a double well."""

import math

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import quad

from tests.klein_kramers import double_well_rate

x, v, y, s, u = sp.symbols("x v y s u", real=True)
c, top, bottom, temperature, D = sp.symbols("c omega_b omega_a Theta D", positive=True)
growth = -c / 2 + sp.sqrt(c**2 / 4 + top**2)


def test_the_density_at_the_barrier_is_stationary():
    """η of u = v − ν y, and η·exp(−E/Θ), with the potential −ω_b² y²/2 and D = 2cΘ."""
    share = (1 + sp.erf(u * sp.sqrt(growth / (2 * c * temperature)))) / 2
    share = share.subs(u, v - (growth + c) * y)
    force = top**2 * y - c * v
    density = share * sp.exp(-(v**2 / 2 - top**2 * y**2 / 2) / temperature)
    change = -v * density.diff(y) - (force * density).diff(v) + c * temperature * density.diff(v, 2)
    numbers = {c: 0.4, top: 1.3, temperature: 0.07}
    places = [(0.1, -0.2), (-0.3, 0.4), (0.0, 0.0)]
    for place in places:
        terms = {y: place[0], v: place[1], **numbers}
        scale = abs(float((c * temperature * density.diff(v, 2)).subs(terms))) + 1e-3
        assert abs(float(change.subs(terms))) < 1e-12 * scale
    assert float(share.subs({y: 0, v: 0})) == 0.5


def test_growth_and_damping_make_the_curvature():
    assert sp.simplify(growth * (growth + c) - top**2) == 0


@pytest.mark.parametrize("damping", [0.05, 0.4, 3.0])
def test_the_flux_over_the_saddle(damping):
    """∫ v η(v) exp(−v²/2Θ) dv = Θ λ_u/ω_b."""
    height, level = 1.3, 0.07
    rate = -damping / 2 + math.sqrt(damping**2 / 4 + height**2)

    def integrand(w):
        share = (1 + math.erf(w * math.sqrt(rate / (2 * damping * level)))) / 2
        return w * share * math.exp(-(w**2) / (2 * level))

    assert quad(integrand, -6, 6, points=[0.0])[0] == pytest.approx(level * rate / height, rel=1e-9)


def test_the_error_of_kramers_rate_is_of_the_order_of_the_noise():
    """Relative errors below D/ΔU, and in proportion to it within the next order."""
    prefactor = (math.sqrt(1.04) - 0.2) * math.sqrt(2) / (2 * math.pi)
    ratios = np.array([6.0, 12.0, 24.0])
    errors = np.array([math.expm1(double_well_rate(0.2, 0.2 / r) - math.log(prefactor) + r) for r in ratios])
    assert np.all(np.abs(errors) < 1 / ratios)
    scaled = errors * ratios
    assert abs(scaled[2] / scaled[1] - 1) < 2 / 12  # the term after it is smaller by D/ΔU


def test_a_prefactor_with_a_power_of_the_noise_shifts_the_slope():
    inverse, energy, power = sp.symbols("s U m", positive=True)
    log_time = power * sp.log(1 / inverse) + energy * inverse
    assert sp.simplify(log_time.diff(inverse) - (energy - power / inverse)) == 0


@pytest.mark.parametrize("depth", [1e-3, 1e-4, 1e-5])
def test_the_rate_at_weak_damping(depth):
    """The factor of Mel'nikov and Meshkov, to first order cI/Θ; the next term has the factor √(cI/Θ)."""
    integral = quad(lambda w: math.log(-math.expm1(-depth * (w * w + 0.25))) / (w * w + 0.25), 0, math.inf, limit=500)
    supplied = math.exp(integral[0] / math.pi)
    assert abs(supplied / depth - 1) < math.sqrt(depth)


def test_rates_add_and_balance():
    """Three states with any rates: the shares of time balance, and two states have the ratio of their rates."""
    rates = np.random.default_rng(1).exponential(size=(3, 3))
    np.fill_diagonal(rates, 0.0)
    generator = rates - np.diag(rates.sum(axis=1))
    shares = np.linalg.lstsq(np.vstack([generator.T, np.ones(3)]), np.array([0, 0, 0, 1.0]), rcond=None)[0]
    np.testing.assert_allclose(shares * rates.sum(axis=1), shares @ rates, rtol=1e-12)
