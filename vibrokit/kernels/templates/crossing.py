"""An event at a stop: it settles which stop pushes, and maps across it what jumps there."""

from numba import njit

from vibrokit.kernels.jumps import DIVERGING, EXTREMALS, LINEARIZED, MOMENTA
from vibrokit.kernels.options import INNER
from vibrokit.kernels.stopping import COMPLETED, GRAZED
from vibrokit.kernels.templates.crossing_extremals import cross_extremals
from vibrokit.kernels.templates.crossing_linear import cross_linear
from vibrokit.kernels.templates.crossing_momenta import cross_momenta
from vibrokit.kernels.templates.settling import settle
from vibrokit.kernels.templates.steps import what_jumps

# --- scene above, stepper below ---


@njit(**INNER)
def cross(i, y, memory, pushing, theta, settings, room):
    """Settle at an event, and map across it what jumps there."""
    if what_jumps(theta) == LINEARIZED:
        return cross_linear(i, y, memory, pushing, theta, settings, room)
    if what_jumps(theta) == MOMENTA:
        return cross_momenta(i, y, memory, pushing, theta, settings, room)
    if what_jumps(theta) == EXTREMALS:
        return cross_extremals(i, y, memory, pushing, theta, settings, room)
    if what_jumps(theta) == DIVERGING:
        return GRAZED
    settle(y, memory, pushing, theta, room)
    return COMPLETED
