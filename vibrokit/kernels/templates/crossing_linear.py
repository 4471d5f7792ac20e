"""Over an event with the linearised motion: where the force jumps, M becomes S M and C becomes S C Sᵀ.

A motion that is ahead by δx at the stop has been under the new force for δx/v longer. The saltation matrix is
S = 1 + (f⁺ − f⁻) nᵀ/(nᵀf⁻) with n = ∂x, of which one entry is left, in the row of v and the column of x (Müller,
Chaos, Solitons & Fractals 5, 1671, 1995).
"""

from numba import njit

from vibrokit.kernels.stopping import RAN_OUT
from vibrokit.kernels.templates.scene import COVARIANCE, DERIVATIVES, STATES, rhs
from vibrokit.kernels.templates.settling import settle
from vibrokit.kernels.templates.steps import CLOCK, INNER, SPARE

# --- scene above, stepper below ---


@njit(**INNER)
def cross(i, y, memory, pushing, theta, settings, desk):
    """Settle at an event, and carry the derivatives and the covariance over it."""
    rhs(y[CLOCK], y, pushing, theta, desk[SPARE])
    before = desk[SPARE, 1]
    settle(y, memory, pushing, theta, desk[SPARE])
    rhs(y[CLOCK], y, pushing, theta, desk[SPARE])
    leap = desk[SPARE, 1] - before
    if leap != 0.0:
        leap /= y[1]
        if DERIVATIVES > 0:
            for e in range(DERIVATIVES, DERIVATIVES + STATES):
                y[e + STATES] += leap * y[e]
        if COVARIANCE > 0:
            of_x, of_v = COVARIANCE, COVARIANCE + STATES  # where the rows of the triangle begin
            y[of_v] += leap * (2.0 * y[of_x + 1] + leap * y[of_x])
            y[of_x + 1] += leap * y[of_x]
            for e in range(2, STATES):
                y[of_v + e - 1] += leap * y[of_x + e]
    return RAN_OUT
