"""Over an event with a covariance C: where the force jumps, C becomes S C Sᵀ, S the saltation matrix.

S = 1 + (f⁺ − f⁻) nᵀ/(nᵀf⁻) with n = ∂x, of which one entry is left, in the row of v and the column of x.
"""

from numba import njit

from vibrokit.kernels.stopping import RAN_OUT
from vibrokit.kernels.templates.scene import STATES, rhs
from vibrokit.kernels.templates.settling import settle
from vibrokit.kernels.templates.steps import CLOCK, INNER, SPARE

# --- scene above, stepper below ---


@njit(**INNER)
def cross(i, y, memory, pushing, theta, settings, desk):
    """Settle at an event, and carry the covariance over it."""
    rhs(y[CLOCK], y, pushing, theta, desk[SPARE])
    before = desk[SPARE, 1]
    settle(y, memory, pushing, theta, desk[SPARE])
    rhs(y[CLOCK], y, pushing, theta, desk[SPARE])
    leap = desk[SPARE, 1] - before
    if leap != 0.0:
        leap /= y[1]
        of_x, of_v = STATES, 2 * STATES  # where the rows of the triangle begin
        y[of_v] += leap * (2.0 * y[of_x + 1] + leap * y[of_x])
        y[of_x + 1] += leap * y[of_x]
        for e in range(2, STATES):
            y[of_v + e - 1] += leap * y[of_x + e]
    return RAN_OUT
