"""x on a circle: where the force of the spring repeats along x, states a period apart have the same motion.

The flow stays on the line; points are compared on the circle.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibrokit.oscillator import Oscillator
from vibrokit.symbolic.repetition import period_along_x

Array = NDArray[np.float64]


def turn_of(osc: Oscillator) -> float:
    """Return the distance along x (m) by which states may be moved without a change of motion; 0 if there is none.

    Between stops, and between poles, motion does not turn over.
    """
    turn = period_along_x(osc.spring) if osc.spring is not None and not osc.barriers else 0.0
    return 0.0 if turn and osc.model.domain else turn


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
