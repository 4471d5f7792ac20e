"""Momenta and derivatives across an event: the saltation matrix of Hamilton's equations.

At the touch of a stop p₁ jumps by −p₂ ΔF(v)/v (see `crossing_momenta`), a map g of the phase z = (q, p). A path that
is ahead by δx has been under the new equations for δx/v longer, so that δz becomes Dg (δz − f⁻ δx/v) + f⁺ δx/v, with
f⁻ before and f⁺ after the jump. A force that does not jump, but whose slope does, has g = 1 and f⁺ ≠ f⁻ still.
"""

from numba import njit

from vibrokit.kernels.links import rhs
from vibrokit.kernels.options import INNER
from vibrokit.kernels.pointers import offset_by
from vibrokit.kernels.stopping import COMPLETED, GRAZED
from vibrokit.kernels.templates.grazing import grazes
from vibrokit.kernels.templates.scene import ROW, STATES
from vibrokit.kernels.templates.settling import settle
from vibrokit.kernels.templates.steps import CLOCK, TOUCHED

# --- scene above, stepper below ---

PHASE = 2 * STATES
MATRIX = PHASE + 1


@njit(**INNER)
def cross_extremals(i, y, memory, pushing, theta, settings, room):
    """Settle at an event, and map the momenta and all derivatives across it."""
    before, after = room, offset_by(room, ROW)  # the slopes of the last step are no longer needed
    pushed = pushing[i]
    rhs(y[CLOCK], y, pushing, theta, before)
    if (memory[TOUCHED] < 0.0 or pushed) and grazes(i, y, before[1], theta, settings):
        return GRAZED
    settle(y, memory, pushing, theta, offset_by(room, 2 * ROW))
    if pushing[i] == pushed:
        return COMPLETED
    rhs(y[CLOCK], y, pushing, theta, after)
    v = y[1]
    leap = (after[1] - before[1]) / v
    slope_in_v = before[STATES + 1] - after[STATES + 1]  # p₂ ∂ΔF/∂v, for p₂′ = −p₁ − p₂ ∂F/∂v …
    in_v = (leap * y[STATES + 1] - slope_in_v) / v
    y[STATES] -= leap * y[STATES + 1]
    rhs(y[CLOCK], y, pushing, theta, after)
    for column in range(MATRIX, MATRIX + PHASE):
        lapse = y[column] / v
        of_v = y[column + PHASE] - lapse * before[1]
        of_p = y[column + (STATES + 1) * PHASE] - lapse * before[STATES + 1]
        for row in range(PHASE):
            y[column + row * PHASE] += lapse * (after[row] - before[row])
        y[column + STATES * PHASE] += in_v * of_v - leap * of_p
    return COMPLETED


@njit(**INNER)
def turn_law(i, y, pushing, theta, room):
    """Switch a law on or off where it passes zero: there the rates of the momenta jump, by j = −p₂ ∂F/∂q.

    The event is at F(q) = 0, whose normal is along j, so that δp jumps by j (j·δq)/(j·q′).
    """
    before, after = room, offset_by(room, ROW)
    rhs(y[CLOCK], y, pushing, theta, before)
    pushing[i] = not pushing[i]
    rhs(y[CLOCK], y, pushing, theta, after)
    along = 0.0
    for e in range(STATES):
        along += (after[STATES + e] - before[STATES + e]) * before[e]
    if along == 0.0:
        return
    for column in range(MATRIX, MATRIX + PHASE):
        share = 0.0
        for e in range(STATES):
            share += (after[STATES + e] - before[STATES + e]) * y[column + e * PHASE]
        share /= along
        for e in range(STATES):
            y[column + (STATES + e) * PHASE] += share * (after[STATES + e] - before[STATES + e])
