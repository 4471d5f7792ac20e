"""Duration of a contact without other forces, by quadrature."""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq

from vibrokit.oscillator import Oscillator
from vibrokit.symbolic.numeric import contact_force_of

_SHALLOWEST, _DEEPEST = 1e-15, 1e6  # depths (in speed over ω_n) between which a contact turns back


def contact_time(osc: Oscillator, index: int, speed: float) -> float:
    """Return the time from touch to release at one stop for an impact at some speed (m s⁻¹).

    The force is that at rate 0, which conserves energy. The largest depth d follows from ∫₀ᵈ F dδ = v²/2, and the time
    is 2 ∫₀ᵈ dδ/√(v² − 2∫F). For kδ that is π/√k; for kδ^(3/2) it is 2.94 d/v. NaN if the force does not turn the mass
    back.
    """
    force = contact_force_of(osc.model, index)
    length = speed / osc.natural_frequency
    nodes, weights = np.polynomial.legendre.leggauss(40)

    def work(low: float, high: float) -> float:
        """∫F dδ, in δ = low + (high − low) s²: smooth at touch for half-integer powers."""
        s = 0.5 * (nodes + 1)
        forces = np.array([max(force(low + (high - low) * each**2, 0.0), 0.0) for each in s])
        return float((high - low) * (weights * s * forces).sum())

    def excess(depth: float) -> float:
        return work(0.0, depth) - 0.5 * speed**2

    low, high = length * _SHALLOWEST, length * _DEEPEST
    if not excess(low) < 0 < excess(high):
        return math.nan
    logarithm = brentq(lambda each: excess(math.exp(each)), math.log(low), math.log(high), xtol=1e-13)
    depth = math.exp(logarithm)

    def integrand(s: float) -> float:  # δ = d(1 − s²): the speed vanishes like s at the turning point
        remaining = 2 * work(depth * (1 - s * s), depth)
        return 2 * s * depth / math.sqrt(remaining) if remaining > 0 else 0.0

    return 2 * float(quad(integrand, 0.0, 1.0, epsrel=1e-8, limit=50)[0])
