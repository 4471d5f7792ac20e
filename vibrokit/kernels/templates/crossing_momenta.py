"""Momenta across an event: where the force jumps, so does p₁.

An extremal path is refracted at a stop as a ray is where the index jumps (the corner conditions of Weierstrass and
Erdmann): q, p₂ and H = p₁ v + p₂ b₂ + ½ a p₂² are continuous, so p₁ v + p₂ F is, and p₁ jumps by −p₂ ΔF/v.
"""

from numba import njit

from vibrokit.kernels.links import rhs
from vibrokit.kernels.options import INNER
from vibrokit.kernels.stopping import COMPLETED, GRAZED
from vibrokit.kernels.templates.grazing import grazes
from vibrokit.kernels.templates.scene import STATES
from vibrokit.kernels.templates.settling import settle
from vibrokit.kernels.templates.steps import CLOCK, TOUCHED

# --- scene above, stepper below ---


@njit(**INNER)
def cross_momenta(i, y, memory, pushing, theta, settings, slope):
    """Settle at an event, and map the momenta across it."""
    involved = memory[TOUCHED] < 0.0 or pushing[i]
    rhs(y[CLOCK], y, pushing, theta, slope)
    before = slope[1]
    if involved and grazes(i, y, before, theta, settings):
        return GRAZED
    settle(y, memory, pushing, theta, slope)
    rhs(y[CLOCK], y, pushing, theta, slope)
    leap = y[STATES + 1] * (slope[1] - before)
    if leap != 0.0:
        y[STATES] -= leap / y[1]
    return COMPLETED
