"""What a motion on a boundary does in the end: it recurs, closes to a cycle, or wanders on a chaotic set."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline

from vibrokit.results.saddle import Saddle
from vibrokit.structure.boundaries.edges import EdgeTrack

NEAR = 1e-3
"""Distance, in widths of the region, within which a motion on a boundary is near a saddle, or near where it was."""

Array = NDArray[np.float64]


def same_place(points: Array, places: Array, distance: float) -> bool:
    """Whether each point (count, 2) is within a distance of one of some places."""
    return bool(np.linalg.norm(points[:, None] - places, axis=2).min(axis=1).max() < distance)


def recurrence(points: Array, longest: int) -> int:
    """Return the number of sections after which a motion recurs for good; 0 if it does not.

    Its points (count, 2) are in units of the region's widths. On a chaotic set a motion passes near periodic orbits at
    any distance, the smaller the rarer. It converges to one if it is near where it was 48 times in a row.
    """
    for period in range(1, min(longest, len(points) - 1) + 1):
        apart = np.linalg.norm(points[period:] - points[:-period], axis=1)
        staying = len(apart) >= 48 and apart[-48:].max() < NEAR
        if apart[-period:].max() < 1e-6 or staying:
            return period
    return 0


def almost_repeats(points: Array, last: int, longest: int) -> bool:
    """Whether the last points of a motion are near what they were some sections before."""
    return any(
        np.linalg.norm(points[-last:] - points[-last - period : -period], axis=1).max() < NEAR
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
        if highest >= back and abs(heights[highest] - heights[highest - back]) < NEAR * width:
            state = points[int(turns[highest] / interval)].copy()
            state[0], state[1] = heights[highest], 0.0
            return state, float(turns[highest] - turns[highest - back])
    return None


def chaotic_set(tracks: Sequence[EdgeTrack], interval: float) -> tuple[Saddle, float]:
    """Return the set on which motions on a boundary never repeat, and the standard error of its exponent.

    The exponent is the mean rate at which neighbours on two sides of the boundary separate, and its error is that of
    six blocks of each motion. The first quarter of a motion is its transient.
    """
    kept = [len(track.points) // 4 for track in tracks]
    points = np.concatenate([track.points[first:] for track, first in zip(tracks, kept, strict=True)])
    stretches = [np.array_split(track.stretches[first:], 6) for track, first in zip(tracks, kept, strict=True)]
    blocks = np.array([block.mean() for each in stretches for block in each]) / interval
    exponent, error = float(blocks.mean()), float(blocks.std(ddof=1)) / len(blocks) ** 0.5
    found = Saddle(
        kind="chaotic",
        period=0,
        duration=np.nan,
        points=points,
        nodes=points[:0],
        multipliers=np.empty(0, dtype=complex),
        exponents=np.array([exponent], dtype=complex),
        leads_to=tracks[0].labels,
        residual=np.nan,
        error=np.nan,
    )
    return found, error
