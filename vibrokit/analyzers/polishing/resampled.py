"""ResampledCandidate: a candidate at the nodes of a path, and the noise-free motion after it."""

from __future__ import annotations

import dataclasses
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.errors import StructureError
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.symbolic.flow_kind import Flow

_AFTER = 32  # section intervals of noise-free motion after a candidate: it may pass a saddle that far beyond its end
_ROUNDING = 1e-6  # of a piece: difference of two times that are equal

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class ResampledCandidate:
    """A candidate at the nodes."""

    candidate: Candidate
    states: Array  # (nodes, n): a piece apart, the first on the section
    after: Array  # (more, n): the noise-free motion from the last node on, that node included

    @cached_property
    def all_states(self) -> Array:
        """Nodes of the candidate and of the motion after it."""
        return np.concatenate([self.states, self.after[1:]])


def resampled(propagator: SegmentPropagator, candidate: Candidate) -> ResampledCandidate:
    """Bring a candidate to the nodes, and follow the noise-free motion from its end.

    Raises StructureError if the candidate has no duration, or states that are not finite.
    """
    if not np.isfinite(candidate.states).all():
        raise StructureError("it has states that are not finite.")
    times, given = candidate.times - candidate.times[0], candidate.states
    if len(times) < 2 or not times[-1] > 0:
        raise StructureError("it has only one state, so there is no path to polish.")
    nodes = int(np.ceil(times[-1] / propagator.piece - _ROUNDING))
    states = []
    for node in range(nodes + 1):
        time = node * propagator.piece
        last = int(np.searchsorted(times, time + _ROUNDING * propagator.piece, side="right")) - 1
        states.append(_carried(propagator, given[last], times[last], time - times[last]))
    after = propagator.onward(states[-1], nodes, _AFTER * propagator.pieces)
    return ResampledCandidate(candidate, np.array(states), after)


def _carried(propagator: SegmentPropagator, state: Array, start: float, duration: float) -> Array:
    if duration <= _ROUNDING * propagator.piece:
        return state
    osc, begin = propagator.osc, start % propagator.osc.section_interval
    return run_ensemble(
        osc, Flow.STATE, propagator.stepper, state[None], start_time=begin, interval=duration
    ).states[0]  # fmt: skip
