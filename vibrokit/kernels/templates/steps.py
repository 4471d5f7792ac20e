"""One step of order 8, in time or in a variable in which a contact is smooth.

A half-integer law makes the force go like (t − t_c)^(3/2) after a touch at t_c: every method loses its order there. In
τ = √(t − t_c) the motion is analytic from the touch through the turning point, and in u = √depth it is analytic down
to the moment the mass leaves, which comes at u = 0 exactly. So the time travels as the last component of the state,
y = (z, t), and a step may run along any of three courses.
"""

import numpy as np
from numba import njit

from vibrokit.kernels.error_blocks import error_blocks
from vibrokit.kernels.tableau import FIFTH, NODES, RESULT, STAGES, THIRD, WEIGHTS
from vibrokit.kernels.templates.scene import BARRIERS, EQUATIONS, OPTIONS, SIDES, STATES, rhs, stop

# --- scene above, stepper below ---

TIME, ROOT_TIME, ROOT_DEPTH = 0, 1, 2
CLOCK = EQUATIONS  # where the time stands in y
TRIAL, STAGE, SPARE, SIZE, ROWS = STAGES, STAGES + 1, STAGES + 2, STAGES + 3, STAGES + 4  # rows of the desk
# What is remembered between steps: how long the next step shall last in free flight, in contact and at the next touch,
# which stop is touched (−1: none), since when (nan: unknown), whether its law would pull, whether the next step must
# run in time, the steps tried, and the time to travel.
FREE_STEP, CONTACT_STEP, FIRST_STEP, TOUCHED, SINCE, PULLED, TIMED, COUNT, SPAN = 0, 1, 2, 3, 4, 5, 6, 7, 8
MEMORY = 9
EPSILON = 2.220446049250313e-16
# Functions that only kernels call: Numba need not wrap them for Python.
INNER = {**OPTIONS, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
BLOCKS = error_blocks(STATES, EQUATIONS)


@njit(**INNER)
def copy(source, target):
    # Assigning slices would compile Numba's shape messages, for seconds.
    for e in range(CLOCK + 1):
        target[e] = source[e]


@njit(**INNER)
def slope(course, sigma, reach, i, pushing, theta, desk, row):
    """Put the slope at the point in STAGE, at sigma on a course, in a row; `reach` is the length of the step."""
    y, weight = desk[STAGE], 1.0
    if BARRIERS > 0:
        if course != TIME:
            wall, side = stop(i, theta), SIDES[i]
            if course == ROOT_DEPTH:
                y[0] = wall + side * sigma * sigma
            depth, rate = side * (y[0] - wall), side * y[1]
            if depth < 64.0 * EPSILON * abs(wall) + 1e-16 * reach * reach * abs(rate if course == ROOT_TIME else 1.0):
                first_slope(course, sigma, reach, i, pushing, theta, desk, row)
                return
            weight = 2.0 * sigma if course == ROOT_TIME else 2.0 * np.sqrt(depth) / rate
    weighted_slope(weight, y, pushing, theta, desk[row])


@njit(**INNER)
def first_slope(course, sigma, reach, i, pushing, theta, desk, row):
    """The slope so near to the stop that x cannot tell how near.

    The second derivative of a law is infinite at depth 0 while its product with sigma is not: there, continue the
    slope from two depths that x does represent.
    """
    # Rows are made into arrays only here: arrays handed on cost more than a slope.
    y, out, spare = desk[STAGE], desk[row], desk[SPARE]
    x, wall, side = y[0], stop(i, theta), SIDES[i]
    rate = side * y[1]
    along = rate if course == ROOT_TIME else 1.0  # depth = along sigma² near the stop
    least = 64.0 * EPSILON * abs(wall) + 1e-16 * reach * reach * abs(along)
    if course == ROOT_TIME and (rate <= 0.0 or sigma * sigma * rate > 4.0 * least):
        y[0] = wall + side * least
        weighted_slope(2.0 * sigma, y, pushing, theta, out)
    else:
        y[0] = wall + side * least
        first = np.sqrt(side * (y[0] - wall) / along)
        weighted_slope(2.0 * first if course == ROOT_TIME else 2.0 * first / rate, y, pushing, theta, spare)
        y[0] = wall + side * 4.0 * least
        second = np.sqrt(side * (y[0] - wall) / along)
        weighted_slope(2.0 * second if course == ROOT_TIME else 2.0 * second / rate, y, pushing, theta, out)
        share = (sigma - first) / (second - first)
        for e in range(CLOCK + 1):
            out[e] = spare[e] + share * (out[e] - spare[e])
    y[0] = x


@njit(**INNER)
def weighted_slope(weight, y, pushing, theta, out):
    rhs(y[CLOCK], y, pushing, theta, out)
    for e in range(EQUATIONS):
        out[e] *= weight
    out[CLOCK] = weight


@njit(**INNER)
def attempt(course, sigma, h, y, i, pushing, theta, desk):
    """Take a step from y, whose slope is in row 0 of the desk, and leave its end in row TRIAL."""
    stage, trial = desk[STAGE], desk[TRIAL]
    for s in range(1, STAGES):
        for e in range(CLOCK + 1):
            total = WEIGHTS[s, 0] * desk[0, e]
            for j in range(1 if s < 5 else 3, s):  # the later stages do not use slopes 1 and 2
                total += WEIGHTS[s, j] * desk[j, e]
            stage[e] = y[e] + h * total
        slope(course, sigma + NODES[s] * h, h, i, pushing, theta, desk, s)
    for e in range(CLOCK + 1):
        total = RESULT[0] * desk[0, e]
        for s in range(5, STAGES):
            total += RESULT[s] * desk[s, e]
        trial[e] = y[e] + h * total
    if BARRIERS > 0 and course == ROOT_DEPTH:
        trial[0] = stop(i, theta) + SIDES[i] * (sigma + h) ** 2


@njit(**INNER)
def misfit(h, y, span, tolerance, desk):
    """Estimated error of the step in TRIAL, in units of the tolerance: the largest over the components.

    Each block is judged by its own size. A velocity that vanishes is judged by x over `span`, the time to travel.
    """
    size, trial = desk[SIZE], desk[TRIAL]
    for e in range(EQUATIONS):
        size[e] = 0.0
    for e in range(EQUATIONS):
        size[BLOCKS[e]] = max(size[BLOCKS[e]], abs(y[e]), abs(trial[e]), abs(h * desk[0, e]))
    size[BLOCKS[1]] = max(size[BLOCKS[1]], size[BLOCKS[0]] / span)
    fifth, third = 0.0, 0.0
    for e in range(CLOCK + 1):
        a, b = FIFTH[0] * desk[0, e], THIRD[0] * desk[0, e]
        for s in range(5, STAGES):
            a += FIFTH[s] * desk[s, e]
            b += THIRD[s] * desk[s, e]
        unit = size[BLOCKS[e]] if e < EQUATIONS else min(span, size[0] / (abs(trial[1]) + size[0] / span))
        if not (np.isfinite(trial[e]) and np.isfinite(a)):
            return np.inf
        if unit > 0.0:
            fifth = max(fifth, abs(a) / unit)
            third = max(third, abs(b) / unit)
    if fifth == 0.0:
        return 0.0
    return abs(h) * fifth * fifth / np.sqrt(fifth * fifth + 0.01 * third * third) / tolerance


@njit(**INNER)
def stretch(error):
    """By how much to lengthen the next step."""
    if not np.isfinite(error):
        return 0.1
    return min(6.0, max(0.15, 0.9 * max(error, 1e-12) ** -0.125))
