"""Borders of the forces of a scene, as its poles are: regions and searches end there."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vibrokit.kernels.vector_field import VectorField
from vibrokit.oscillator import Oscillator
from vibrokit.results.region import Region

Array = NDArray[np.float64]


def length_between_borders(osc: Oscillator) -> float:
    """Return the distance (m) from x = 0 to the nearest border; 0 for a scene without.

    Where x = 0 is itself a border, or beyond one, it is twice the distance to the farthest place of rest, or else the
    distance to the farther border.
    """
    low, high = osc.model.domain.around(0.0)
    if low < 0.0 < high:
        nearest = min(-low, high)
        return nearest if math.isfinite(nearest) else 0.0
    side = 1.0 if low >= 0.0 else -1.0
    near, far = sorted((abs(low), abs(high)))
    away = near + np.geomspace(1e-12, 1e12, 24 * 32 + 1)
    away = away[away < far]
    states = np.zeros((len(away), 2 + len(osc.noise.extra_states if osc.noise else ())))
    states[:, 0] = side * away
    outward = VectorField(osc).rate(states)[:, 1] > 0
    rests = away[1:][outward[1:] != outward[:-1]]
    lengths = [*(2.0 * rests[-1:]), *([far] if math.isfinite(far) else [])]
    return float(f"{min(lengths, default=0.0):.9g}")


def between_borders(osc: Oscillator, region: Region, places: Sequence[float] = (0.0,)) -> Region:
    """Return the part of a region that lies between the borders around some places (m)."""
    ends = [osc.model.domain.around(place) for place in places]
    low, high = max(region.x[0], min(end[0] for end in ends)), min(region.x[1], max(end[1] for end in ends))
    return dataclasses.replace(region, x=(low, high)) if (low, high) != region.x else region


def apart(osc: Oscillator, one: float, other: float) -> bool:
    """Return whether a border lies between two places (m), which no motion crosses, with noise or without."""
    return osc.model.domain.around(one) != osc.model.domain.around(other)


def connected(osc: Oscillator, region: Region, place: float) -> bool:
    """Return whether motion from a region may come to a place (m): some of the region is in the same interval."""
    low, high = osc.model.domain.around(place)
    return low <= place <= high and low < region.x[1] and region.x[0] < high


def intervals_within(osc: Oscillator, low: float, high: float) -> list[tuple[float, float]]:
    """Return the parts of a range of x (m) between borders; those that end at a border end a little before it.

    The ends of the range may be borders, too: those of a default region are.
    """
    domain, found = osc.model.domain, []
    for one, other in domain.intervals(low, high):
        beside = 1e-9 * (other - one)
        first, last = (beside * bool(domain.borders(end - beside, end + beside)) for end in (one, other))
        found.append((one + first, other - last))
    return found
