"""Course: a candidate brought to the nodes, and followed without noise beyond its end."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.candidate import Candidate
from vibrokit.analyzers.polishing.carrier import Carrier
from vibrokit.errors import StructureError
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.symbolic.flow_kind import Flow

_ROUNDING = 1e-6

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class Course:
    """A candidate at the nodes.

    Attributes
    ----------
    candidate : Candidate
    states : array (nodes, n)
        A piece apart, the first on the section.
    beyond : array (more, n)
        How the motion goes on without noise, the last node first.
    """

    candidate: Candidate
    states: Array
    beyond: Array


def course_of(carrier: Carrier, candidate: Candidate, periods: int) -> Course:
    """Bring a candidate to the nodes, and follow it for some periods beyond its end.

    Raises
    ------
    StructureError
        The candidate has no length.
    """
    if not np.isfinite(candidate.states).all():
        raise StructureError(f"a candidate of {candidate.finder} has states that are not finite.")
    times, given = candidate.times - candidate.times[0], candidate.states
    if len(times) < 2 or not times[-1] > 0:
        raise StructureError(f"a candidate of {candidate.finder} has one state only, so there is no path to polish.")
    nodes = int(np.ceil(times[-1] / carrier.piece - _ROUNDING))
    states = []
    for node in range(nodes + 1):
        time = node * carrier.piece
        last = int(np.searchsorted(times, time + _ROUNDING * carrier.piece, side="right")) - 1
        states.append(_carried(carrier, given[last], times[last], time - times[last]))
    return Course(candidate, np.array(states), carrier.onward(states[-1], nodes, periods * carrier.pieces))


def _carried(carrier: Carrier, state: Array, start: float, duration: float) -> Array:
    if duration <= _ROUNDING * carrier.piece:
        return state
    begin = start % carrier.osc.section_interval
    return run_ensemble(
        carrier.osc, Flow.STATE, carrier.stepper, state[None], start_time=begin, interval=duration
    ).states[0]
