"""Chaotic sets on the boundaries of basins: motions there that never repeat."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vibrokit.results.saddle import Saddle
from vibrokit.structure.boundaries.edges import EdgeTrack

_APPROACH = 0.25  # fraction of a motion that does not recur which is its transient
_BLOCKS = 6  # of a motion, for the standard error


def chaotic_set(tracks: Sequence[EdgeTrack], exponent: float) -> Saddle:
    """Return the record of a set on which motions on a boundary never repeat."""
    points = np.concatenate([track.points[_transient(track) :] for track in tracks])
    return Saddle(
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


def _transient(track: EdgeTrack) -> int:
    return int(_APPROACH * len(track.points))


def growth(tracks: Sequence[EdgeTrack], interval: float) -> tuple[float, float]:
    """Mean rate at which neighbours on two sides of a boundary separate, and its standard error from blocks."""
    blocks = np.concatenate(
        [[block.mean() for block in np.array_split(track.stretches[_transient(track) :], _BLOCKS)] for track in tracks]
    )
    return float(blocks.mean()) / interval, float(blocks.std(ddof=1)) / len(blocks) ** 0.5 / interval
