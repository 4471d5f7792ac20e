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
    region: NDArray[np.float64],
    labels: NDArray[np.int8],
    home: int,
    points: NDArray[np.float64],
    point_labels: NDArray[np.int64],
    tolerance: float,
) -> tuple[int, int]:
    """Decide whether a trajectory stops at this section, and with which label.

    Parameters
    ----------
    x, v : float
        State at the section.
    region : array (2, 2)
        Least and largest x, least and largest v; infinite bounds switch the test off.
    labels : array (cells in x, cells in v)
        Label of the attractor that each cell of the region leads to, negative where unknown. An empty array switches
        the test off.
    home : int
        Label of the basin that the trajectory started in.
    points : array (K, 2)
        Known points of the section; none switches the test off.
    point_labels : array (K,)
    tolerance : float
        Distance at which a known point counts as reached.

    Returns
    -------
    status, label : int
        `COMPLETED` and −1 if nothing stops it.
    """
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
