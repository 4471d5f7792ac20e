"""The linearised motion across an event: where the force jumps, M becomes S M and C becomes S C Sᵀ.

A motion that is ahead by δx at the stop has been under the new force for δx/v longer. The saltation matrix is
S = 1 + (f⁺ − f⁻) nᵀ/(nᵀf⁻) with n = ∂x; it differs from 1 in one entry, in the row of v and the column of x (Müller,
Chaos, Solitons & Fractals 5, 1671, 1995).
"""

from numba import njit

from vibrokit.kernels.links import rhs
from vibrokit.kernels.options import INNER
from vibrokit.kernels.stopping import COMPLETED
from vibrokit.kernels.templates.scene import STATES
from vibrokit.kernels.templates.settling import settle
from vibrokit.kernels.templates.steps import CLOCK, covariance, derivatives

# --- scene above, stepper below ---


@njit(**INNER)
def cross_linear(i, y, memory, pushing, theta, settings, slope):
    """Settle at an event, and map the derivatives and the covariance across it."""
    rhs(y[CLOCK], y, pushing, theta, slope)
    before = slope[1]
    settle(y, memory, pushing, theta, slope)
    rhs(y[CLOCK], y, pushing, theta, slope)
    leap = slope[1] - before
    if leap != 0.0:
        leap /= y[1]
        first = derivatives(theta)
        if first > 0:
            for e in range(first, first + STATES):
                y[e + STATES] += leap * y[e]
        of_x = covariance(theta)
        if of_x > 0:
            of_v = of_x + STATES  # where the second row of the triangle begins
            y[of_v] += leap * (2.0 * y[of_x + 1] + leap * y[of_x])
            y[of_x + 1] += leap * y[of_x]
            for e in range(2, STATES):
                y[of_v + e - 1] += leap * y[of_x + e]
    return COMPLETED
