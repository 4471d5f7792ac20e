"""The exact exit rate of a symmetric double well, from the spectrum of the Klein–Kramers operator."""

import math

import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import eigs

_WIDTH = 0.28  # of the oscillator functions in x; the wells are at ±1


def double_well_rate(damping: float, intensity: float, functions: int = 200, moments: int = 110) -> float:
    """ln of the rate from one well of x⁴/4 − x²/2 to the other, with damping 2ζ and noise of intensity D.

    The density is expanded in Hermite functions of v (Brinkman's hierarchy) and of x (Risken, "The Fokker–Planck
    Equation", section 10.1). Of the modes that are odd under (x, v) → (−x, −v), the slowest decays at twice the rate.
    """
    friction, temperature = 2 * damping, intensity / (4 * damping)
    lowering = np.diag(np.sqrt(np.arange(1.0, functions + 8)), 1)  # eight more than are kept: products are exact
    place, slope = _WIDTH * (lowering + lowering.T), (lowering - lowering.T) / (2 * _WIDTH)
    force = (place @ place @ place - place)[:functions, :functions]
    slope = slope[:functions, :functions]
    up = math.sqrt(temperature) * slope + force / (2 * math.sqrt(temperature))
    down = math.sqrt(temperature) * slope - force / (2 * math.sqrt(temperature))
    roots = np.sqrt(np.arange(1.0, moments))
    operator = (
        -friction * sparse.kron(sparse.diags(np.arange(float(moments))), sparse.identity(functions))
        - sparse.kron(sparse.diags(roots, 1), sparse.csr_matrix(down))
        - sparse.kron(sparse.diags(roots, -1), sparse.csr_matrix(up))
    ).tocsc()
    odd = np.flatnonzero(np.add.outer(np.arange(moments), np.arange(functions)).ravel() % 2)
    slowest = eigs(operator[odd][:, odd], k=1, sigma=0.0, return_eigenvectors=False)[0]
    return math.log(-slowest.real / 2)
