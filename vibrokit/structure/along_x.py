"""The x axis of a scene: turns, after which the motion is the same, and borders, which no motion crosses.

Where the force of the spring repeats along x, points are compared on the circle of one turn; the flow stays on the
line. Borders of the forces, such as poles, end regions and searches.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vibrokit.kernels.vector_field import VectorField
from vibrokit.oscillator import Oscillator
from vibrokit.results.region import Region
from vibrokit.symbolic.repetition import period_along_x

Array = NDArray[np.float64]


def states_at(osc: Oscillator, places: Array) -> Array:
    """Return states (…, n) at places (…, 2) in x and v; states of the noise are 0."""
    extra = len(osc.noise.extra_states) if osc.noise else 0
    return np.concatenate([places, np.zeros((*places.shape[:-1], extra))], axis=-1) if extra else places


def turn_of(osc: Oscillator) -> float:
    """Return the distance along x (m) by which states may be moved without a change of motion; 0 if there is none.

    Between stops, and between poles, motion does not turn over.
    """
    turn = period_along_x(osc.spring) if osc.spring is not None and not osc.barriers else 0.0
    return 0.0 if turn and (osc.model.domain or not _forces_repeat(osc, turn)) else turn


@functools.lru_cache(maxsize=256)
def _forces_repeat(osc: Oscillator, turn: float) -> bool:
    """Whether forces of time and state are the same a turn further."""
    if not osc.depends_on_state:
        return True
    field = VectorField(osc)

    def forces(moved: float) -> Array:
        places = [(0.3 * k * osc.time_unit, (0.7 * k + moved, 0.4 - k)) for k in range(1, 6)]
        return np.array([[field.excitation(i, *place) for i in range(len(osc.excitations))] for place in places])

    here, there = forces(0.0), forces(turn)
    return bool(np.abs(there - here).max() <= 1e-9 * np.abs(here).max())


def turns_to(osc: Oscillator, states: Array, middle: float = 0.0) -> Array:
    """Return by how many turns (…) the states (…, n) lie off the turn around a place; 0 where x does not repeat."""
    turn = turn_of(osc)
    if not turn:
        return np.zeros(states.shape[:-1])
    return np.asarray(np.rint(np.nan_to_num((states[..., 0] - middle) / turn)))


def wrapped(osc: Oscillator, states: Array, middle: float = 0.0) -> Array:
    """Return states, or differences of states, moved by whole turns to those nearest to a place along x."""
    if not turn_of(osc):
        return states
    return shifted(states, -turn_of(osc) * turns_to(osc, states, middle))


def shifted(states: Array, distance: Array | float) -> Array:
    """Return states (…, n) moved along x by a distance (…)."""
    moved = np.array(states, dtype=float)
    moved[..., 0] += distance
    return moved


def between_borders(osc: Oscillator, region: Region, places: Sequence[float] = (0.0,)) -> Region:
    """Return the part of a region that lies between the borders around some places (m)."""
    ends = [osc.model.domain.around(place) for place in places]
    low, high = max(region.x[0], min(end[0] for end in ends)), min(region.x[1], max(end[1] for end in ends))
    return dataclasses.replace(region, x=(low, high)) if (low, high) != region.x else region


def apart(osc: Oscillator, one: float, other: float) -> bool:
    """Return whether a border lies between two places (m)."""
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
