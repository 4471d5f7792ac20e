"""Climbing: the score of each trajectory, interpolated on a grid, and the highest one so far (splitting in MFET)."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
Whole = NDArray[np.int64]


@njit(nogil=True, cache=True, error_model="numpy")
def _bracket(value: float, nodes: Array) -> tuple[int, float]:
    """The node at or below a value, and how far it is to the next one; the ends beyond them."""
    low, high = 0, nodes.size - 1
    if not value > nodes[0]:
        return 0, 0.0
    if value >= nodes[high]:
        return high - 1, 1.0
    while high - low > 1:
        middle = (low + high) // 2
        if nodes[middle] <= value:
            low = middle
        else:
            high = middle
    return low, (value - nodes[low]) / (nodes[high] - nodes[low])


@njit(nogil=True, cache=True, error_model="numpy")
def climb(
    visits: Array,  # (count, most, n): states
    counts: Whole,  # (count,): how many of them there are
    phases: Whole,  # (count,): looks from a section to the start of each row
    looks: int,  # in a section interval
    times: Array,  # (stages,): in section intervals, ascending from 0
    xs: Array,
    vs: Array,
    values: Array,  # (stages, nx, nv)
    highest: Array,  # (count,): the largest score so far, which is raised
    scores: Array,  # (count, most): of those that are higher than all before; −∞ elsewhere
) -> None:
    """Score all states, by linear interpolation, and keep the records."""
    stages, shares = np.empty((looks, 2), dtype=np.int64), np.empty(looks)
    for look in range(looks):
        place = int(np.searchsorted(times, look / looks + 1e-12, side="right")) - 1
        later = times[place + 1] if place + 1 < times.size else 1.0
        stages[look, 0], stages[look, 1] = place, (place + 1) % times.size
        shares[look] = max(look / looks - times[place], 0.0) / (later - times[place])
    for row in range(counts.size):
        for place in range(scores.shape[1]):
            scores[row, place] = -np.inf
        for place in range(counts[row]):
            look = (phases[row] + 1 + place) % looks
            i, a = _bracket(visits[row, place, 0], xs)
            j, b = _bracket(visits[row, place, 1], vs)
            score = 0.0
            for later in range(2):
                weight, known = (shares[look] if later else 1.0 - shares[look]), values[stages[look, later]]
                if weight == 0.0:
                    continue
                low = (1.0 - b) * known[i, j] + b * known[i, j + 1]
                high = (1.0 - b) * known[i + 1, j] + b * known[i + 1, j + 1]
                score += weight * ((1.0 - a) * low + a * high)
            if score > highest[row]:
                highest[row] = score
                scores[row, place] = score
