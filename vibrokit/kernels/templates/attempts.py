"""Attempts: a step of order 8 of every lane, each of its own length and along its own course, and its error."""

from math import sqrt

import numpy as np
from numba import njit

from vibrokit.kernels.intrinsics import keep_apart, offset_by, use_widest_registers
from vibrokit.kernels.links import rhs, slopes_lanes
from vibrokit.kernels.options import INNER, INNER_LANES
from vibrokit.kernels.rows import add_estimates, add_stage, compare_rows, join_rows
from vibrokit.kernels.tableau import NODES, STAGES


@njit(**INNER)
def extrapolate(node, place, lane, lanes, pushing, theta, room):
    """Replace a slope at a depth that x does not represent: extrapolate from three that it does.

    They are at σ₁, 2 σ₁ and 4 σ₁. A derivative of a law is infinite at depth 0 while its product with a power of σ is
    not. `place` is where the slope begins among the numbers of the lanes.
    """
    y, size, root = room, size_of(lanes), lanes[ROOT + lane]
    near, far, farthest = offset_by(room, ROW), offset_by(room, 2 * ROW), offset_by(room, 3 * ROW)
    pushed = offset_by(pushing, lane * barriers(theta))
    for e in range(CLOCK, size):
        y[e] = lanes[POINT + e * LANES + lane]
    wall, side = lanes[WALL + lane], lanes[SIDE + lane]
    depth, rate = side * (y[0] - wall), side * y[1]
    deep = lanes[COURSE + lane] > 1.5  # along the root of the depth
    along, scale = (1.0, root / rate) if deep else (rate, root)  # depth = along sigma^root near the stop
    first, double = root_of(root, depth / along), power_of(root, 2.0)
    scale *= power_of(root, first) / first
    rhs(y[CLOCK], y, pushed, theta, near)
    y[0] = wall + side * double * depth
    rhs(y[CLOCK], y, pushed, theta, far)
    y[0] = wall + side * double * double * depth
    rhs(y[CLOCK], y, pushed, theta, farthest)
    s = (lanes[SIGMA + lane] + node * lanes[LENGTH + lane]) / first
    one, two, four = (s - 2.0) * (s - 4.0) / 3.0, (s - 1.0) * (4.0 - s) / 2.0, (s - 1.0) * (s - 2.0) / 6.0
    two, four = two * double / 2.0, four * double * double / 4.0  # with how fast the depth changes there
    for e in range(1, size):  # x and t change at finite rates
        lanes[place + e * LANES] = scale * (one * near[e] + two * far[e] + four * farthest[e])


# Facts of a flow: whether it may need `extrapolate`; and, with rows counted from that of the time, the first row that
# holds derivatives of momenta, and of each row the first row of its block. The rows of a block have one scale.
CURVED, HAZY, BLOCKS = 0, 1, 2


@njit(**INNER_LANES)
def attempt(lanes, pushing, theta, room, facts):
    """Take a step from STATE to TRIAL in each lane, along its course."""
    keep_apart(), use_widest_registers()
    curved, rows = facts[CURVED] > 0.0, size_of(lanes) - CLOCK
    start, length = offset_by(lanes, STATE + CLOCK * LANES), offset_by(lanes, LENGTH)
    point, end = offset_by(lanes, POINT + CLOCK * LANES), offset_by(lanes, TRIAL + CLOCK * LANES)
    slopes, stride = offset_by(lanes, SLOPES + CLOCK * LANES), ROW * LANES
    for stage in range(STAGES):
        add_stage(stage, point, start, length, slopes, stride, rows)
        slopes_lanes(NODES[stage], lanes, offset_by(lanes, SLOPES + stage * stride), theta)
        if STOPS and curved:
            for lane in range(LANES):
                if lanes[NEAR + lane] > 0.5:
                    extrapolate(NODES[stage], SLOPES + stage * stride + lane, lane, lanes, pushing, theta, room)
    add_stage(STAGES, end, start, length, slopes, stride, rows)
    if STOPS:
        for lane in range(LANES):
            if lanes[COURSE + lane] == ROOT_DEPTH:
                sigma = lanes[SIGMA + lane] + lanes[LENGTH + lane]
                lanes[TRIAL + lane] = lanes[WALL + lane] + lanes[SIDE + lane] * power_of(lanes[ROOT + lane], sigma)


@njit(**INNER_LANES)
def misfit(lanes, tolerance, span, floor, facts):
    """Find the ERROR of each attempt in units of the tolerance, and the FACTOR by which to lengthen the next.

    The error is the largest over the blocks of rows, each measured by its own size; a velocity near 0 by a hundredth of
    x over `span`, the time to integrate over. Where a force finds the mass at rest at 0, x is measured by `floor`: its
    own size begins there as a power of time, for which no step is short enough.
    """
    keep_apart(), use_widest_registers()
    rows, stride = size_of(lanes) - CLOCK, ROW * LANES
    start, end = offset_by(lanes, STATE + CLOCK * LANES), offset_by(lanes, TRIAL + CLOCK * LANES)
    slopes, sizes = offset_by(lanes, SLOPES + CLOCK * LANES), offset_by(lanes, SIZES + CLOCK * LANES)
    fifths, thirds = offset_by(lanes, FIFTHS + CLOCK * LANES), offset_by(lanes, THIRDS + CLOCK * LANES)
    most, haze, blocks = offset_by(lanes, MOST), offset_by(lanes, HAZE), offset_by(facts, BLOCKS)
    add_estimates(sizes, fifths, thirds, start, end, offset_by(lanes, LENGTH), slopes, stride, rows)
    join_rows(sizes, blocks, rows)
    choose_units(tolerance, span, floor, lanes)
    compare_rows(most, sizes, haze, fifths, thirds, end, blocks, int(facts[HAZY]), rows)
    conclude_errors(lanes)


@njit(**INNER_LANES)
def choose_units(tolerance, span, floor, lanes):
    """Replace the sizes of t and v by the units of their errors; write the tolerance and the haze of each lane.

    No step must be more accurate than the rounding of x allows: GRAIN is the uncertainty of the acceleration from it.
    So is that of the second derivative of a law, which affects only derivatives of the momenta.
    """
    for lane in range(LANES):
        clock, reach, speed = CLOCK * LANES + lane, lanes[SIZES + lane], lanes[SIZES + LANES + lane]
        reach = floor if floor > reach else reach
        least = 0.01 * reach / span
        speed = speed if speed > least else least
        allowed, haze = tolerance, 1.0
        if STOPS:
            blur = lanes[GRAIN + lane] * abs(lanes[TRIAL + clock] - lanes[STATE + clock])
            allowed = blur / speed if blur > tolerance * speed else tolerance
            depth = lanes[SIDE + lane] * (lanes[TRIAL + lane] - lanes[WALL + lane])
            depth = depth if depth > lanes[DEPTH + lane] else lanes[DEPTH + lane]
            haze = 4.0 * EPSILON * abs(lanes[STATE + lane]) / depth
            haze = haze / allowed if haze > allowed else 1.0
        lapse = reach / (abs(lanes[TRIAL + LANES + lane]) + reach / span)
        lanes[SIZES + clock] = lapse if lapse < span else span
        lanes[SIZES + lane], lanes[SIZES + LANES + lane] = reach, speed
        lanes[ALLOWED + lane], lanes[HAZE + lane] = allowed, haze


@njit(**INNER_LANES)
def conclude_errors(lanes):
    """Find the errors of all lanes from the two largest estimates.

    The fifth-order estimate can vanish by chance. In a step that is short enough the error is 0.02 to 0.1 times the
    square of the third-order one, which is a lower bound.
    """
    for lane in range(LANES):
        length = lanes[LENGTH + lane]
        fifth, third, broken = lanes[MOST + lane], lanes[MOST + LANES + lane], lanes[MOST + 2 * LANES + lane]
        largest = fifth if fifth > third else third
        part, other = (fifth / largest, third / largest) if largest > 0.0 else (0.0, 1.0)  # squares may vanish
        error = abs(length) * fifth * part / sqrt(part * part + 0.01 * other * other)
        least = length * third
        least = 0.01 * least * least
        error = (error if error > least else least) / lanes[ALLOWED + lane] if third > 0.0 else 0.0
        error = error if broken == 0.0 else np.inf
        lanes[ERROR + lane] = error
        error = error if error > 1e-12 else 1e-12
        factor = 0.9 / sqrt(sqrt(sqrt(error)))
        factor = factor if factor < 5.0 else 5.0
        lanes[FACTOR + lane] = factor if factor > 0.15 else (0.15 if broken == 0.0 else 0.1)
