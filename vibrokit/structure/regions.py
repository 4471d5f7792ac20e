"""Regions that follow from the scene and from its attractors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.results.region import Region
from vibrokit.results.saddle import Saddle
from vibrokit.structure.scales import length_of

_MARGIN = 0.25  # of the width, on each side
_RESTING = 1e-3

Array = NDArray[np.float64]


def states_at(osc: Oscillator, places: Array) -> Array:
    """Return states (…, n) at places (…, 2); states of the noise are 0."""
    extra = len(osc.noise.extra_states) if osc.noise else 0
    return np.pad(places, (*[(0, 0)] * (places.ndim - 1), (0, extra)))


def search_region(osc: Oscillator) -> Region:
    """Return a region for starts: it contains the stops, and the reach of a linear oscillator under the same forces."""
    reach = length_of(osc)
    return Region((-reach, reach), (-reach * osc.natural_frequency, reach * osc.natural_frequency))


def frame_of(osc: Oscillator, attractors: Sequence[Attractor]) -> Region:
    """Return a region that contains the attractors' points and the stops, with a margin around them.

    It is at least as wide as the gap between two stops. Without two stops it is at least as wide as the widest motion,
    or, if all attractors are at rest, as the length scale of the scene.
    """
    points = np.concatenate([attractor.points[:, :2] for attractor in attractors])
    cycles = [attractor.orbit for attractor in attractors if attractor.kind == "limit cycle"]
    points = np.concatenate([points, *cycles])
    places = [barrier.position for barrier in osc.barriers]
    gap = float(np.ptp(places)) if len(places) == 2 else 0.0
    x, v = points.T
    low, high = min([x.min(), *places]), max([x.max(), *places])
    swings = [0.5 * float(np.ptp(attractor.orbit[:, 0])) for attractor in attractors]
    widest = max(swings)
    least = 0.5 * gap or (widest if widest > _RESTING * length_of(osc) else length_of(osc))
    middle, half = 0.5 * (low + high), max(0.5 * (high - low), least)
    swing = float(np.abs(x - x.mean()).max())
    speed = max(osc.natural_frequency * max(swing, least), float(np.abs(v).max()))
    half, speed = half * (1 + 2 * _MARGIN), speed * (1 + 2 * _MARGIN)
    return Region((float(middle - half), float(middle + half)), (-speed, speed))


def lies_in(region: Region, orbit: Attractor | Saddle) -> bool:
    """Whether some point of an orbit on the section is in a region; of a limit cycle, whether any of its points is."""
    points = orbit.orbit if isinstance(orbit, Attractor) and orbit.kind == "limit cycle" else orbit.points
    return bool(region.contains(points).any())
