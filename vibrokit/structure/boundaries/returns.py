"""Returns of a motion: whether it recurs, and where a cycle closes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline

_RECURRENCE = 1e-6  # of the region's widths: a motion has returned
_CLOSE = 1e-3  # of the region's widths: a motion that returns within this distance
_STAY = 48  # times in a row converges to an orbit

Array = NDArray[np.float64]


def same_place(points: Array, places: Array, distance: float) -> bool:
    """Whether each point (count, 2) is within a distance of one of some places."""
    return bool(np.linalg.norm(points[:, None] - places, axis=2).min(axis=1).max() < distance)


def recurrence(points: Array, longest: int) -> int:
    """Return the number of sections after which a motion recurs for good; 0 if it does not.

    Its points (count, 2) are in units of the region's widths. On a chaotic set a motion passes near periodic orbits at
    any distance, the smaller the rarer.
    """
    for period in range(1, min(longest, len(points) - 1) + 1):
        apart = np.linalg.norm(points[period:] - points[:-period], axis=1)
        staying = len(apart) >= _STAY and apart[-_STAY:].max() < _CLOSE
        if apart[-period:].max() < _RECURRENCE or staying:
            return period
    return 0


def almost_repeats(points: Array, last: int, longest: int, near: float) -> bool:
    """Whether the last points of a motion are close to what they were some sections before."""
    return any(
        np.linalg.norm(points[-last:] - points[-last - period : -period], axis=1).max() < near
        for period in range(1, min(longest, len(points) - last) + 1)
    )


def closing(points: Array, width: float, interval: float) -> tuple[Array, float] | None:
    """Estimate the turning point of greatest x and the duration of a cycle from a motion, if it closes at its end.

    `width` is that of the region in x.
    """
    motion = CubicHermiteSpline(interval * np.arange(len(points)), points[:, 0], points[:, 1])
    turns = motion.derivative().roots(extrapolate=False)
    turns = turns[motion.derivative(2)(turns) < 0]
    heights = motion(turns)
    for back in range(1, len(turns)):
        highest = len(turns) - back + int(np.argmax(heights[-back:]))
        if highest >= back and abs(heights[highest] - heights[highest - back]) < _CLOSE * width:
            state = points[int(turns[highest] / interval)].copy()
            state[0], state[1] = heights[highest], 0.0
            return state, float(turns[highest] - turns[highest - back])
    return None
