"""Where to look: regions that follow from the scene, and from what was found."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.results.region import Region

_STRENGTHS = ("amplitude", "force")
_RESONANCE = 5.0


def search_region(osc: Oscillator) -> Region:
    """Return a region wide enough for starts: the stops, and the reach of a linear oscillator under the same forces."""
    numbers = [value for part in osc.excitations for name, value in part.parameters.items() if name in _STRENGTHS]
    push = float(sum(abs(number) for number in numbers)) / osc.natural_frequency**2
    free = len(osc.barriers) < 2  # where nothing limits it, a resonance makes more of the push
    places = [2 * abs(barrier.position) for barrier in osc.barriers]
    reach = max([1.0, _RESONANCE * push if free else push, *places])
    return Region((-reach, reach), (-reach * osc.natural_frequency, reach * osc.natural_frequency))


def frame_of(osc: Oscillator, attractors: Sequence[Attractor]) -> Region:
    """Return a region that holds the attractors' points and the stops, with room around them."""
    points = np.concatenate([attractor.points[:, :2] for attractor in attractors])
    curves = [attractor.orbit for attractor in attractors if attractor.kind == "limit cycle"]
    points = np.concatenate([points, *curves])
    reach = np.abs(points - points.mean(axis=0)).max()
    places = [[barrier.position, 0.0] for barrier in osc.barriers]
    speed = max(
        reach * osc.natural_frequency, np.abs(points[:, 1]).max(), 0.5 * np.ptp([p[0] for p in places] or [0.0])
    )
    corners = np.array([*points, *places, [points[0, 0], speed], [points[0, 0], -speed]])
    return Region.around(corners, margin=0.25)
