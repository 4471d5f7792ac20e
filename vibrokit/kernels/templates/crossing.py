"""Events at a stop: which stop is touched, whether it pushes, and what jumps there.

Linearised motion. A motion that is ahead by δx at the stop has been under the new force for δx/v longer. The saltation
matrix is S = 1 + (f⁺ − f⁻) nᵀ/(nᵀf⁻) with n = ∂x; it differs from 1 in one entry, in the row of v and the column of x
(Müller, Chaos, Solitons & Fractals 5, 1671, 1995). M becomes S M and C becomes S C Sᵀ.

Momenta. An extremal path is refracted at a stop as a ray is where the index jumps (the corner conditions of Weierstrass
and Erdmann): q, p₂ and H = p₁ v + p₂ b₂ + ½ a p₂² are continuous, so p₁ v + p₂ F is, and p₁ jumps by −p₂ ΔF/v.

Momenta and their derivatives. The jump of p₁ is a map g of the phase z = (q, p), and δz becomes
Dg (δz − f⁻ δx/v) + f⁺ δx/v, with f⁻ before and f⁺ after the jump. A force that does not jump, but whose slope does, has
g = 1 and f⁺ ≠ f⁻ still.
"""

import numpy as np
from numba import njit

from vibrokit.kernels.intrinsics import offset_by
from vibrokit.kernels.links import law, rhs
from vibrokit.kernels.located import DIVERGING, EXTREMALS, LINEARIZED, MOMENTA
from vibrokit.kernels.options import INNER
from vibrokit.kernels.stopping import COMPLETED, GRAZED


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


BLURRED = 10.0


@njit(**INNER)
def grazes(i, y, acceleration, theta, settings):
    """Whether an event at a stop whose force jumps is so slow that errors decide the jump of the momenta.

    Whether the stop is touched at all, and by how much p₁ jumps, depends on the speed. Its square is known to the
    tolerance times (a/ω_n)², for the mass has been near to the stop for v/a, out of times of 1/ω_n: below ten times
    that, v is uncertain by more than some 5 %. Nor is it known where x is rounded. Without momentum nothing jumps.
    """
    if not jumps_at(i, theta) or y[STATES + 1] == 0.0:
        return False
    if is_clamped(i, theta) and push_at(i, y, theta) < 0.0:
        return False  # a law that would pull is cut: no force
    scale, square = acceleration * settings[3], y[1] * y[1]
    return square <= BLURRED * settings[0] * scale * scale or square <= 8.0 * EPSILON * abs(
        stop(i, theta) * acceleration
    )


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
