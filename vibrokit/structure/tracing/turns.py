"""Turns of a steady motion next to the places where stops are first touched, seen from both sides."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vibrokit.kernels.single import record
from vibrokit.oscillator import Oscillator
from vibrokit.structure.tracing.families import Family, Member
from vibrokit.symbolic.flow_kind import Flow

NEXT_TO = 1e-2
"""Distance from a surface, relative to the extent of the motion, within which a turn counts as next to it."""
_SAMPLES = 256  # in a forcing period or 2π/ω_n, whichever is shorter
_FINER = 64  # samples of the stretch around a turn next to a surface, which is integrated again

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True)
class Surface:
    """Where a stop is first touched, as motion reaches it from one side: from outside, or from within the stop."""

    stop: int  # number of the stop
    leaving: bool  # whether motion reaches it from within the stop

    def direction(self, osc: Oscillator) -> int:
        """Return the direction of x in which motion passes the surface: 1 or −1."""
        return -osc.barriers[self.stop].sign if self.leaving else osc.barriers[self.stop].sign

    def reach(self, osc: Oscillator, x: Array) -> Array:
        """Return how far beyond the surface positions are; negative short of it."""
        return self.direction(osc) * (x - osc.barriers[self.stop].position)


def surfaces_of(osc: Oscillator) -> list[Surface]:
    """Return the surfaces of a scene's stops."""
    return [Surface(stop, leaving) for stop in range(len(osc.barriers)) for leaving in (False, True)]


def turns_at(family: Family, member: Member, scene: Oscillator, surfaces: Sequence[Surface]) -> dict[Surface, Array]:
    """Return how far beyond each surface of a scene a motion is at its turns towards it, the farthest first.

    The unit is the extent of the motion in x. An equilibrium, which turns nowhere, has one reach, from outside, in
    units of the family.
    """
    if family.kind == "equilibrium":
        size, x = family.sizes[0], member.point[:1]
        return {surface: surface.reach(scene, x) / size for surface in surfaces if not surface.leaving}
    osc = family.at(member.value)
    unit = min(osc.section_interval, 2 * math.pi / osc.natural_frequency)
    count = _SAMPLES * math.ceil(member.duration / unit - 1e-9)
    spacing = member.duration / count
    # A sample more, for a turn at the section itself.
    path = record(osc, Flow.STATE, family.stepper, member.point, 0.0, spacing, count + 1)
    extent, found = float(np.ptp(path[:, 0])), {}
    for surface in surfaces:
        reaches: list[float] = []
        for index, reach in _turns(path, spacing, scene, surface):
            if index == count and reaches and _turns(path[:2], spacing, scene, surface):
                continue
            if abs(reach) < NEXT_TO * extent:
                finer = spacing / _FINER
                closer = record(osc, Flow.STATE, family.stepper, path[index], index * spacing, finer, _FINER)
                reach = max((finer_reach for _, finer_reach in _turns(closer, finer, scene, surface)), default=reach)
            reaches.append(reach / extent)
        found[surface] = np.sort(reaches)[::-1]
    return found


def _turns(path: Array, spacing: float, scene: Oscillator, surface: Surface) -> list[tuple[int, float]]:
    """Where a path turns back from a surface: the sample before, and the reach by the cubic through both samples."""
    reach, rate = surface.reach(scene, path[:, 0]), surface.direction(scene) * path[:, 1]
    found = []
    for index in np.flatnonzero((rate[:-1] > 0) & (rate[1:] <= 0)):
        rise, before, after = reach[index + 1] - reach[index], spacing * rate[index], spacing * rate[index + 1]
        # Reach along the step is the cubic r + before·s + bend·s² + twist·s³; it is stationary at the root in (0, 1].
        bend, twist = 3 * rise - 2 * before - after, before + after - 2 * rise
        root = before / (math.sqrt(max(bend * bend - 3 * twist * before, 0.0)) - bend)
        root = min(max(root, 0.0), 1.0) if math.isfinite(root) else 0.5
        found.append((int(index), float(reach[index] + root * (before + root * (bend + root * twist)))))
    return found
