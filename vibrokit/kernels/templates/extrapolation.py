"""Slopes at depths that x does not represent."""

from numba import njit

from vibrokit.kernels.links import rhs
from vibrokit.kernels.options import INNER
from vibrokit.kernels.pointers import offset_by
from vibrokit.kernels.templates.scene import COURSE, LANES, LENGTH, POINT, ROOT, ROW, SIDE, SIGMA, WALL
from vibrokit.kernels.templates.steps import CLOCK, barriers, power_of, root_of, size_of

# --- scene above, stepper below ---


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
