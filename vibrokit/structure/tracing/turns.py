"""Turning points (v = 0) of a steady motion near a stop: how far it is from grazing, on either side."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vibrokit.kernels.single import record
from vibrokit.oscillator import Oscillator
from vibrokit.structure.tracing.families import Member
from vibrokit.symbolic.flow_kind import Flow
from vibrokit.symbolic.numeric import contact_force_of

NEXT_TO = 1e-2
"""Distance from a surface, relative to the extent of the motion, within which a turn counts as next to it."""

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True)
class Surface:
    """Where a stop is first touched, as motion reaches it from one side: from outside, or from within the stop."""

    stop: int  # number of the stop
    leaving: bool  # whether motion reaches it from within the stop

    def reach(self, osc: Oscillator, path: Array, spacing: float) -> tuple[Array, Array]:
        """Return how far beyond the surface the samples of a path are, negative short of it, and how fast it grows."""
        barrier = osc.barriers[self.stop]
        direction = -barrier.sign if self.leaving else barrier.sign
        return direction * (path[:, 0] - barrier.position), direction * path[:, 1]


@dataclasses.dataclass(frozen=True)
class Release(Surface):
    """Where the force of a stop that does not pull falls to 0, as seen from within the stop."""

    def reach(self, osc: Oscillator, path: Array, spacing: float) -> tuple[Array, Array]:
        """Return minus the force (m s⁻²), −∞ outside the stop, and how fast that grows."""
        barrier, force = osc.barriers[self.stop], contact_force_of(osc.model, self.stop)
        depth, rate = barrier.sign * (path[:, 0] - barrier.position), barrier.sign * path[:, 1]
        pushes = [force(one, speed) if one > 0 else math.inf for one, speed in zip(depth, rate, strict=True)]
        reach = -np.array(pushes)
        with np.errstate(invalid="ignore"):
            return reach, np.gradient(reach, spacing, edge_order=2)


def surfaces_of(osc: Oscillator) -> list[Surface]:
    """Return the surfaces of a scene's stops."""
    found = [Surface(stop, leaving) for stop in range(len(osc.barriers)) for leaving in (False, True)]
    return found + [Release(stop, True) for stop, contact in enumerate(osc.model.contacts) if contact.clamped]


def turns_at(member: Member, scene: Oscillator, surfaces: Sequence[Surface]) -> dict[Surface, Array]:
    """Return how far beyond each surface of a scene a motion is at its turns towards it, the farthest first.

    The unit is the extent of the reach, which is that of the motion in x, or of the force. An equilibrium, which turns
    nowhere, has one reach, from outside, in units of the family.
    """
    family = member.family
    osc = family.at(member.value)
    if family.kind == "equilibrium":
        place = member.point[None]
        return {one: one.reach(scene, place, 0.0)[0] / family.sizes[0] for one in surfaces if not one.leaving}
    unit = min(osc.section_interval, 2 * math.pi / osc.reference_frequency)
    count = 256 * math.ceil(member.duration / unit - 1e-9)
    spacing = member.duration / count
    # A sample more, for a turn at the section itself.
    path = record(osc, Flow.STATE, family.stepper, member.point, 0.0, spacing, count + 1)
    found = {}
    for surface in surfaces:
        reach, rate = surface.reach(scene, path, spacing)
        known, reaches = reach[np.isfinite(reach)], list[float]()
        extent = float(np.ptp(known)) if known.size else 0.0
        for index, farthest in _turns(reach, rate, spacing):
            if index == count and reaches and _turns(reach[:2], rate[:2], spacing):
                continue
            if abs(farthest) < NEXT_TO * extent:
                finer = spacing / 64
                closer = record(osc, Flow.STATE, family.stepper, path[index], index * spacing, finer, 64)
                again = _turns(*surface.reach(scene, closer, finer), finer)
                farthest = max((each for _, each in again), default=farthest)
            reaches.append(farthest / extent)
        found[surface] = np.sort(reaches)[::-1]
    return found


def _turns(reach: Array, rate: Array, spacing: float) -> list[tuple[int, float]]:
    """Where a reach is largest: the sample before, and its value by the cubic through both samples."""
    found = []
    for index in np.flatnonzero((rate[:-1] > 0) & np.isfinite(rate[:-1]) & (rate[1:] <= 0)):
        farthest = float(max(reach[index], reach[index + 1]))
        if np.isfinite(rate[index + 1]):  # not where the motion leaves the stop
            rise, before, after = reach[index + 1] - reach[index], spacing * rate[index], spacing * rate[index + 1]
            # The cubic r + before·s + bend·s² + twist·s³ along the step is stationary at the root in (0, 1].
            bend, twist = 3 * rise - 2 * before - after, before + after - 2 * rise
            root = before / (math.sqrt(max(bend * bend - 3 * twist * before, 0.0)) - bend)
            root = min(max(root, 0.0), 1.0) if math.isfinite(root) else 0.5
            farthest = float(reach[index] + root * (before + root * (bend + root * twist)))
        found.append((int(index), farthest))
    return found
