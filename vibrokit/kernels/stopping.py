"""When a trajectory has come far enough: the tests made at each section.

Compiled into every stepper, so that an ensemble stops trajectory by trajectory and nothing is integrated in vain.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

RAN_OUT = 0  # nothing stopped it: the budget of intervals is spent
LEFT_REGION = 1
LEFT_BASIN = 2  # in a cell of the basin grid that belongs to another attractor
REACHED = 3  # within the tolerance of a known point
NOT_FINITE = 4
STALLED = 5  # the step limit of one interval was not enough
GRAZED = 6  # it touched a stop whose force jumps too slowly to tell by how much the momenta jump


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
        `RAN_OUT` and −1 if nothing stops it.
    """
    if not (np.isfinite(x) and np.isfinite(v)):
        return NOT_FINITE, -1
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
    return RAN_OUT, -1


@njit(nogil=True, cache=True, error_model="numpy")
def _cell(value: float, low: float, high: float, count: int) -> int:
    return min(int((value - low) / (high - low) * count), count - 1)
