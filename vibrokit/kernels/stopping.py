"""Stop tests, compiled into every stepper, so that each trajectory of an ensemble ends by itself."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from vibrokit.kernels.cubic import summit

COMPLETED = 0  # all intervals of the budget, without a stop
LEFT_REGION = 1
LEFT_BASIN = 2  # in a cell of the basin grid that belongs to another attractor
REACHED = 3  # in the ellipse around a known point
DIVERGED = 4  # not finite
STALLED = 5  # more steps in one interval than allowed
GRAZED = 6  # at the touch of a stop, too slow to determine a jump of momenta, or at which their derivatives diverge


@njit(nogil=True, cache=True, error_model="numpy")
def stop_status(
    x: float,
    v: float,
    at_section: bool,  # whether labels and points are tested too
    region: NDArray[np.float64],  # (2, 2): bounds of x and of v; infinite ones switch the test off
    area: NDArray[np.float64],  # (2, 2): bounds of x and of v that the cells of `labels` fill
    labels: NDArray[np.int8],  # attractor that each cell leads to, negative where unknown; empty: no test
    home: int,  # label of the basin that the trajectory started in
    points: NDArray[np.float64],  # (K, 2): known points of the section
    point_labels: NDArray[np.int64],  # (K,)
    metrics: NDArray[np.float64],  # (K, 2, 2): R; a point c is reached where |R (q − c)| ≤ 1
    turn: float,  # distance along x at which cells and points repeat; 0 where they do not
) -> tuple[int, int]:
    """Return how a trajectory ends here, and with which label: `COMPLETED` and −1 if it goes on."""
    if not (np.isfinite(x) and np.isfinite(v)):
        return DIVERGED, -1
    if x < region[0, 0] or x > region[0, 1] or v < region[1, 0] or v > region[1, 1]:
        return LEFT_REGION, -1
    if not at_section:
        return COMPLETED, -1
    nearest, least = -1, 1.0
    for k in range(points.shape[0]):
        dx, dv = x - points[k, 0], v - points[k, 1]
        if turn > 0.0:
            dx -= turn * np.rint(dx / turn)
        distance = np.hypot(
            metrics[k, 0, 0] * dx + metrics[k, 0, 1] * dv, metrics[k, 1, 0] * dx + metrics[k, 1, 1] * dv
        )
        if distance <= least:
            nearest, least = k, distance
    if nearest >= 0:
        return REACHED, int(point_labels[nearest])
    if turn > 0.0 and labels.size > 0:
        x -= turn * np.floor((x - area[0, 0]) / turn)
    if labels.size > 0 and area[0, 0] <= x <= area[0, 1] and area[1, 0] <= v <= area[1, 1]:
        label = labels[
            cell_of(x, area[0, 0], area[0, 1], labels.shape[0]),
            cell_of(v, area[1, 0], area[1, 1], labels.shape[1]),
        ]
        if label >= 0 and label != home:
            return LEFT_BASIN, int(label)
    return COMPLETED, -1


@njit(nogil=True, cache=True, error_model="numpy")
def turned_outside(x0: float, v0: float, x1: float, v1: float, interval: float, region: NDArray[np.float64]) -> bool:
    """Whether x left its bounds and turned back between two tests, as the cubic through both ends has it."""
    if v0 > 0.0 > v1:
        return bool(summit(x0, v0, x1, v1, interval) > region[0, 1])
    if v0 < 0.0 < v1:
        return bool(-summit(-x0, -v0, -x1, -v1, interval) < region[0, 0])
    return False


@njit(nogil=True, cache=True, error_model="numpy")
def left_in_step(x0: float, v0: float, x1: float, v1: float, h: float, region: NDArray[np.float64]) -> bool:
    """Whether a step ended outside, or x left its bounds and turned back in it.

    Noise acts on v. Given both ends of a step, the mean of x between them is then the cubic, to order h, and noise adds
    a deviation of √(D h³/192) in the middle.
    """
    if x1 < region[0, 0] or x1 > region[0, 1] or v1 < region[1, 0] or v1 > region[1, 1]:
        return True
    return bool(turned_outside(x0, v0, x1, v1, h, region))


@njit(nogil=True, cache=True, error_model="numpy")
def cell_of(value: float, low: float, high: float, count: int) -> int:
    """Return in which of some cells between two bounds a value lies."""
    return min(int((value - low) / (high - low) * count), count - 1)
