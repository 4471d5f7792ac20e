"""Over an event with derivatives: where the force jumps, so do those of the velocity, by the saltation matrix.

A motion that is ahead by δx at the stop has been under the new force for δx/v longer: S = 1 + (f⁺ − f⁻) nᵀ/(nᵀf⁻),
n = ∂x, of which one entry is left (Müller, Chaos, Solitons & Fractals 5, 1671, 1995).
"""

from numba import njit

from vibrokit.kernels.stopping import RAN_OUT
from vibrokit.kernels.templates.scene import STATES, rhs
from vibrokit.kernels.templates.settling import settle
from vibrokit.kernels.templates.steps import CLOCK, INNER, SPARE

# --- scene above, stepper below ---


@njit(**INNER)
def cross(i, y, memory, pushing, theta, settings, desk):
    """Settle at an event, and carry the derivatives over it."""
    rhs(y[CLOCK], y, pushing, theta, desk[SPARE])
    before = desk[SPARE, 1]
    settle(y, memory, pushing, theta, desk[SPARE])
    rhs(y[CLOCK], y, pushing, theta, desk[SPARE])
    leap = desk[SPARE, 1] - before
    if leap != 0.0:
        leap /= y[1]
        for e in range(STATES):
            y[2 * STATES + e] += leap * y[STATES + e]
    return RAN_OUT
