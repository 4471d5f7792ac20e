"""Slopes at depths that x does not represent."""

import numpy as np
from numba import njit

from vibrokit.kernels.links import rhs
from vibrokit.kernels.options import INNER
from vibrokit.kernels.pointers import offset_by
from vibrokit.kernels.templates.scene import COURSE, LANES, LENGTH, POINT, ROW, SIDE, SIGMA, WALL
from vibrokit.kernels.templates.steps import CLOCK, barriers, size_of

# --- scene above, stepper below ---


@njit(**INNER)
def extrapolate(node, place, lane, lanes, pushing, theta, room):
    """Replace a slope at a depth that x does not represent: extrapolate from two that it does.

    The second derivative of a law is infinite at depth 0 while its product with sigma is not. `place` is where the
    slope begins among the numbers of the lanes.
    """
    y, near, far, size = room, offset_by(room, ROW), offset_by(room, 2 * ROW), size_of(lanes)
    pushed = offset_by(pushing, lane * barriers(theta))
    for e in range(CLOCK, size):
        y[e] = lanes[POINT + e * LANES + lane]
    wall, side = lanes[WALL + lane], lanes[SIDE + lane]
    sigma, depth, rate = lanes[SIGMA + lane] + node * lanes[LENGTH + lane], side * (y[0] - wall), side * y[1]
    deep = lanes[COURSE + lane] > 1.5  # along the root of the depth
    along, scale = (1.0, 2.0 / rate) if deep else (rate, 2.0)  # depth = along sigma² near the stop
    first = np.sqrt(depth / along)
    rhs(y[CLOCK], y, pushed, theta, near)
    y[0] = wall + 4.0 * (y[0] - wall)
    second = np.sqrt(side * (y[0] - wall) / along)
    rhs(y[CLOCK], y, pushed, theta, far)
    near[CLOCK] = far[CLOCK] = 1.0
    for e in range(CLOCK, size):
        low, high = scale * first * near[e], scale * second * far[e]
        lanes[place + e * LANES] = low + (sigma - first) / (second - first) * (high - low)
