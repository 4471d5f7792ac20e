"""One step of order 8, in time or in a variable in which a contact is smooth.

A half-integer law makes the force go like (t − t_c)^(3/2) after a touch at t_c: every method loses its order there. In
τ = √(t − t_c) the motion is analytic from the touch through the turning point, and in u = √depth it is analytic down
to the moment the mass leaves, which is at u = 0 exactly. So the time is the last component of the state, y = (z, t),
and a step may run along any of three courses.
"""

import numpy as np
from numba import njit

from vibrokit.kernels.error_blocks import error_blocks
from vibrokit.kernels.tableau import FIFTH, NODES, RESULT, STAGES, THIRD, WEIGHTS
from vibrokit.kernels.templates.scene import (
    BARRIERS,
    EQUATIONS,
    MOMENTA,
    OPTIONS,
    SIDES,
    STATES,
    rhs,
    stop,
)

# --- scene above, stepper below ---

# Numba compiles a function again for each integer constant that it is called with, so these are no integers.
TIME, ROOT_TIME, ROOT_DEPTH = 0.0, 1.0, 2.0
ZERO = 0.0  # for int(ZERO), an integer that is no constant
CLOCK = EQUATIONS  # place of the time in y
TRIAL, STAGE, SPARE, SIZE, ROWS = STAGES, STAGES + 1, STAGES + 2, STAGES + 3, STAGES + 4  # rows of the workspace
# Memory between steps: durations of the next step in free flight, in contact and at the next touch, the stop that is
# touched (−1: none), since when (nan: unknown), whether its law would pull, whether the next step must run in time, the
# number of attempts, and the time to integrate over.
FREE_STEP, CONTACT_STEP, FIRST_STEP, TOUCHED, SINCE, PULLED, TIMED, COUNT, SPAN = 0, 1, 2, 3, 4, 5, 6, 7, 8
MEMORY = 9
EPSILON = 2.220446049250313e-16
# Functions that only kernels call: Numba need not wrap them for Python.
INNER = {**OPTIONS, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
BLOCKS = error_blocks(STATES, MOMENTA, EQUATIONS)
HAZY = 2 * STATES + 1 if EQUATIONS > 4 * STATES**2 else EQUATIONS  # the first derivative of momenta


@njit(**INNER)
def copy(source, target):
    # Assigning slices would compile Numba's shape messages, for seconds.
    for e in range(CLOCK + 1):
        target[e] = source[e]


@njit(**INNER)
def slope(course, sigma, reach, i, pushing, theta, workspace, row):
    """Put the slope at the point in STAGE, at sigma on a course, in a row; `reach` is the length of the step.

    The second derivative of a law is infinite at depth 0 while its product with sigma is not. Where the
    depth is below the rounding of x, the slope is extrapolated from two depths that x represents.
    """
    x, weight, points = workspace[STAGE, 0], 1.0, 1
    scale, first, second, farther = 1.0, 0.0, 1.0, 0.0
    if BARRIERS > 0:
        if course != TIME:
            wall, side = stop(i, theta), SIDES[i]
            if course == ROOT_DEPTH:
                x = wall + side * sigma * sigma
                workspace[STAGE, 0] = x
            depth, rate = side * (x - wall), side * workspace[STAGE, 1]
            weight = 2.0 * sigma if course == ROOT_TIME else 2.0 * sigma / rate
            along = rate if course == ROOT_TIME else 1.0  # depth = along sigma² near the stop
            least = 64.0 * EPSILON * abs(wall) + 1e-16 * reach * reach * abs(along)
            if depth < least:
                workspace[STAGE, 0] = wall + side * least
                if course == ROOT_DEPTH or (rate > 0.0 and sigma * sigma * rate <= 4.0 * least):
                    points = 2
                    scale = 2.0 if course == ROOT_TIME else 2.0 / rate
                    first = np.sqrt(side * (workspace[STAGE, 0] - wall) / along)
                    farther = wall + 4.0 * (workspace[STAGE, 0] - wall)
                    second = np.sqrt(side * (farther - wall) / along)
                    weight = scale * first
    # One call in a loop: handing these arrays to a function that is not inlined would cost more than the slope.
    for point in range(points):
        rhs(workspace[STAGE, CLOCK], workspace[STAGE], pushing, theta, workspace[row])
        if point > 0:
            weight = scale * second
        for e in range(CLOCK + 1):
            rate = weight * (workspace[row, e] if e < CLOCK else 1.0)
            if point > 0:
                rate = workspace[SPARE, e] + (sigma - first) / (second - first) * (rate - workspace[SPARE, e])
            workspace[row, e] = rate
            workspace[SPARE, e] = rate
        workspace[STAGE, 0] = farther
    workspace[STAGE, 0] = x


@njit(**INNER)
def attempt(course, sigma, h, y, i, pushing, theta, workspace):
    """Take a step from y, whose slope is in row 0 of the workspace, and leave its end in row TRIAL."""
    stage, trial = workspace[STAGE], workspace[TRIAL]
    for s in range(1, STAGES):
        for e in range(CLOCK + 1):
            stage[e] = 0.0
        for j in range(s):
            for e in range(CLOCK + 1):
                stage[e] += WEIGHTS[s, j] * workspace[j, e]
        for e in range(CLOCK + 1):
            stage[e] = y[e] + h * stage[e]
        slope(course, sigma + NODES[s] * h, h, i, pushing, theta, workspace, s)
    for e in range(CLOCK + 1):
        trial[e] = 0.0
    for s in range(STAGES):
        for e in range(CLOCK + 1):
            trial[e] += RESULT[s] * workspace[s, e]
    for e in range(CLOCK + 1):
        trial[e] = y[e] + h * trial[e]
    if BARRIERS > 0 and course == ROOT_DEPTH:
        trial[0] = stop(i, theta) + SIDES[i] * (sigma + h) ** 2


@njit(**INNER)
def misfit(h, y, span, tolerance, grain, haze, workspace):
    """Estimated error of the step in TRIAL, in units of the tolerance: the largest over the components.

    Each block is measured by its own size; a velocity near 0 by a hundredth of x over `span`, the time to integrate
    over. No step must be more accurate than the rounding of x allows: `grain` is the uncertainty of the acceleration
    from it, `haze` the relative one of the second derivative of a law, which affects only derivatives of the momenta.
    """
    size, trial = workspace[SIZE], workspace[TRIAL]
    for e in range(EQUATIONS):
        size[e] = 0.0
    for e in range(EQUATIONS):
        size[BLOCKS[e]] = max(size[BLOCKS[e]], abs(y[e]), abs(trial[e]), abs(h * workspace[0, e]))
    size[BLOCKS[1]] = max(size[BLOCKS[1]], 0.01 * size[BLOCKS[0]] / span)
    blur = grain * abs(trial[CLOCK] - y[CLOCK])
    if blur > tolerance * size[BLOCKS[1]]:
        tolerance = blur / size[BLOCKS[1]]
    fifth, third = 0.0, 0.0
    for e in range(CLOCK + 1):
        a, b = FIFTH[0] * workspace[0, e], THIRD[0] * workspace[0, e]
        for s in range(5, STAGES):
            a += FIFTH[s] * workspace[s, e]
            b += THIRD[s] * workspace[s, e]
        unit = size[BLOCKS[e]] if e < EQUATIONS else min(span, size[0] / (abs(trial[1]) + size[0] / span))
        if HAZY <= e < EQUATIONS and haze > tolerance:
            unit *= haze / tolerance
        if not (np.isfinite(trial[e]) and np.isfinite(a)):
            return np.inf
        if unit > 0.0:
            fifth = max(fifth, abs(a) / unit)
            third = max(third, abs(b) / unit)
    if third == 0.0:
        return 0.0
    error = abs(h) * fifth * fifth / np.sqrt(fifth * fifth + 0.01 * third * third)
    # The fifth-order estimate can vanish by chance. In a step that is short enough the error is 0.02 to 0.1 times the
    # square of the third-order one.
    return max(error, 0.01 * (h * third) ** 2) / tolerance


@njit(**INNER)
def stuck(error, before, tolerance):
    """Whether shortening a step has not reduced its error, which is then rounding."""
    return error > 0.8 * before and error * tolerance < 1e-6


@njit(**INNER)
def stretch(error):
    """Factor by which to lengthen the next step."""
    if not np.isfinite(error):
        return 0.1
    return min(5.0, max(0.15, 0.9 * max(error, 1e-12) ** -0.125))
