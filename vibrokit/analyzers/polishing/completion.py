"""Completion: a path started and ended so near to its orbits that its action no longer changes."""

from __future__ import annotations

import numpy as np

from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.polishing.extremal_path import ExtremalPath
from vibrokit.analyzers.polishing.newton import extremal_path
from vibrokit.analyzers.polishing.tolerances import TOLERANCES
from vibrokit.errors import StructureError

MORE_PERIODS = 2
"""Periods of its orbits by which a certified path must allow to be extended."""
_CLOSER = 4  # times that the radius is divided by 10
_MOST_FAILURES = 6  # of steps that bring a path within a radius; generic paths have none


def completed(propagator: SegmentPropagator, found: ExtremalPath) -> ExtremalPath:
    """Return the same path, started and ended so near to its orbits that the action no longer changes.

    Raises StructureError if it cannot be joined to them by the linearized equations.
    """
    radius = TOLERANCES.radius * found.extent
    try:
        found = within(propagator, found, radius)
    except StructureError:
        if not found.flat:  # of one of a family, only the error of the linearized equations may be too large
            raise
        radius /= 10
        found = within(propagator, found, radius)
    for _ in range(_CLOSER):
        radius /= 10
        closer = within(propagator, found, radius)
        if abs(closer.action - found.action) <= TOLERANCES.unchanged * abs(found.action):
            break
        found = closer
    return found


def within(propagator: SegmentPropagator, found: ExtremalPath, radius: float) -> ExtremalPath:
    """Return the same path, started and ended within a radius of its orbits.

    It is made longer in steps where all at once does not converge. Raises StructureError if no step does.
    """
    grain, source, share, failures = propagator.grain, found.source, 1, 0
    while True:
        before = 0 if source.start_on_orbit else source.missing(found.points, found.first, -1, radius, grain) // grain
        after = found.ending.missing(found.points, radius) // grain
        try:
            longer = solved_again(propagator, found, int(before / share) * grain, int(after / share) * grain)
        except StructureError:
            failures += 1
            if failures > _MOST_FAILURES or max(abs(before), abs(after)) < 2 * share:
                raise
            share *= 2
            continue
        if share == 1:
            return longer
        found, share = longer, share // 2


def solved_again(
    propagator: SegmentPropagator, found: ExtremalPath, before: int, after: int, accepted: float = TOLERANCES.accepted
) -> ExtremalPath:
    """Solve for the same path with so many nodes more (or fewer, if negative) before and after.

    Raises StructureError if it does not converge, or if hardly anything of the path would be left.
    """
    points, first = found.points, found.first
    if len(points) + min(before, 0) + min(after, 0) < 2:
        raise StructureError(
            f"a path of {len(points)} nodes cannot be made {-min(before, 0) - min(after, 0)} nodes shorter."
        )
    more = found.source.continued(points[0], first, -max(before, 0))
    points = np.concatenate([more, points[max(-before, 0) :]])
    points, ending = found.ending.extended(points, after)
    return extremal_path(
        propagator, found.source, first - before, ending, points, found.last,
        evaluations=TOLERANCES.evaluations // 8, accepted=accepted,
    )  # fmt: skip
