"""Stop tests at each section, compiled into every stepper, so that each trajectory of an ensemble ends by itself."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

COMPLETED = 0  # all intervals of the budget, without a stop
LEFT_REGION = 1
LEFT_BASIN = 2  # in a cell of the basin grid that belongs to another attractor
REACHED = 3  # within the tolerance of a known point
DIVERGED = 4  # not finite
STALLED = 5  # more steps in one interval than allowed
GRAZED = 6  # the contact with a stop whose force jumps was too slow to determine the jump of the momenta


@njit(nogil=True, cache=True, error_model="numpy")
def section_status(
    x: float,
    v: float,
    region: NDArray[np.float64],  # (2, 2): bounds of x and of v; infinite ones switch the test off
    labels: NDArray[np.int8],  # attractor that each cell of the region leads to, negative where unknown; empty: no test
    home: int,  # label of the basin that the trajectory started in
    points: NDArray[np.float64],  # (K, 2): known points of the section
    point_labels: NDArray[np.int64],  # (K,)
    tolerance: float,  # distance at which a known point counts as reached
) -> tuple[int, int]:
    """Return how a trajectory ends at this section, and with which label: `COMPLETED` and −1 if it goes on."""
    if not (np.isfinite(x) and np.isfinite(v)):
        return DIVERGED, -1
    if x < region[0, 0] or x > region[0, 1] or v < region[1, 0] or v > region[1, 1]:
        return LEFT_REGION, -1
    nearest, least = -1, tolerance
    for k in range(points.shape[0]):
        distance = np.hypot(x - points[k, 0], v - points[k, 1])
        if distance <= least:
            nearest, least = k, distance
    if nearest >= 0:
        return REACHED, int(point_labels[nearest])
    if labels.size > 0:
        label = labels[
            _cell(x, region[0, 0], region[0, 1], labels.shape[0]),
            _cell(v, region[1, 0], region[1, 1], labels.shape[1]),
        ]
        if label >= 0 and label != home:
            return LEFT_BASIN, int(label)
    return COMPLETED, -1


@njit(nogil=True, cache=True, error_model="numpy")
def _cell(value: float, low: float, high: float, count: int) -> int:
    return min(int((value - low) / (high - low) * count), count - 1)
