"""Lead-in: the motion on the attractor itself, from which a path sets out."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.results.attractor import Attractor

# Relaxation times on the attractor. A path that has t relaxation times to reach a state near it costs 1/(1 − e^(−2t))
# of what one without a beginning costs up to there, by the linearized equations: 0.03 % more.
_RELAXATIONS = 4.0
_LONGEST = 250  # section intervals

Array = NDArray[np.float64]


def lead_in(attractor: Attractor, propagator: SegmentPropagator, state: Array) -> Array:
    """Return states (count, 2) on an attractor, a piece apart, that end a piece before a section state near it.

    The first one is on the section. A path through them and the state, relaxed with the first one held, leaves from
    the attractor itself.
    """
    steps, interval = propagator.pieces, propagator.osc.section_interval
    units = np.array([propagator.osc.natural_frequency, 1.0])
    intervals = min(_LONGEST, max(1, math.ceil(_RELAXATIONS * _relaxation(attractor) / interval)))
    curve = attractor.orbit if attractor.kind == "limit cycle" else attractor.points
    place = int(np.argmin(np.linalg.norm((curve[:, :2] - state) * units, axis=1)))
    if attractor.kind == "limit cycle":
        back = place - intervals * interval / attractor.duration * (len(curve) - 1)
        at = back % (len(curve) - 1)
        start = np.array([np.interp(at, np.arange(len(curve)), curve[:, axis]) for axis in (0, 1)])
    elif attractor.is_fixed:
        start = curve[(place - intervals) % len(curve), :2]
    else:
        intervals = min(intervals, place)  # points follow each other in time
        start = curve[place - intervals, :2]
    return propagator.onward(start, 0, intervals * steps)[:-1]


def _relaxation(attractor: Attractor) -> float:
    """The time in which deviations from an attractor fall by a factor e (s); 0 where that is not known."""
    rates = np.sort(attractor.exponents.real)
    if attractor.kind == "limit cycle":
        rates = rates[:-1]  # without that of a shift along it
    slowest = float(-rates[-1]) if len(rates) else 0.0
    return 1 / slowest if slowest > 0 else 0.0
