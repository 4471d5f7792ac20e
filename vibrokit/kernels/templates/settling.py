"""Finds which stop is touched, and whether it pushes."""

import numpy as np
from numba import njit

from vibrokit.kernels.links import law, rhs
from vibrokit.kernels.options import INNER
from vibrokit.kernels.templates.steps import (
    CLOCK,
    CONTACT_STEP,
    EPSILON,
    FIRST_STEP,
    PULLED,
    SINCE,
    SPAN,
    TIMED,
    TOUCHED,
    barriers,
    is_clamped,
    side_of,
    smoothing_of,
    stop,
)

# --- scene above, stepper below ---


@njit(**INNER)
def settle(y, memory, pushing, theta, slope):
    """Find the stop that is touched at y: by depth; at depth 0 by rate; at rest there by acceleration."""
    memory[TOUCHED], memory[SINCE], memory[PULLED], memory[TIMED] = -1.0, np.nan, 0.0, 0.0
    switch_off(pushing, theta)
    for i in range(barriers(theta)):
        wall, rate = stop(i, theta), side_of(i, theta) * y[1]
        depth = side_of(i, theta) * (y[0] - wall)
        touched = depth > 0.0
        if depth == 0.0:
            switch_off(pushing, theta)
            rhs(y[CLOCK], y, pushing, theta, slope)
            acceleration = side_of(i, theta) * slope[1]
            # A contact too shallow for x to represent does not count.
            seen = rate * rate > 8.0 * EPSILON * abs(wall) * abs(acceleration)
            seen = seen and abs(rate) * memory[SPAN] > EPSILON * abs(wall)
            touched = rate > 0.0 if seen else acceleration > 0.0
            if touched and smoothing_of(i, theta) > 1.0:
                memory[SINCE] = y[CLOCK]
        if touched:
            memory[TOUCHED] = i
            memory[CONTACT_STEP] = max(memory[FIRST_STEP], shortest(y[CLOCK], wall, rate, memory))
            memory[PULLED] = 1.0 if is_clamped(i, theta) and push_at(i, y, theta) < 0.0 else 0.0
            pushing[i] = memory[PULLED] == 0.0
            return


@njit(**INNER)
def shortest(now, wall, rate, memory):
    """Shortest first step in a contact in which time and depth change visibly. The one before may have been shorter.

    Steps that change nothing are all the same, and the motion would end there.
    """
    span = memory[SPAN]
    return min(span, 4.0 * EPSILON * (abs(now) + span + (abs(wall) / rate if rate > 0.0 else 0.0)))


@njit(**INNER)
def switch_off(pushing, theta):
    for i in range(barriers(theta)):
        pushing[i] = False


@njit(**INNER)
def push_at(i, y, theta):
    return push_of(i, y[0], y[1], theta)


@njit(**INNER)
def push_of(i, x, v, theta):
    return law(i, max(side_of(i, theta) * (x - stop(i, theta)), 1e-30), side_of(i, theta) * v, theta)
