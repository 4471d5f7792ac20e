"""Where a trajectory ended, and at which border of the forces."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibrokit.kernels.choice import single_stepper
from vibrokit.kernels.single import record
from vibrokit.kernels.stepper import Stepper
from vibrokit.parts.scene import Scene
from vibrokit.symbolic.flow_kind import Flow

_ROUNDS, _PARTS = 3, 32  # in which the time of the end is narrowed down, and parts of an interval in each
_REACH = 16.0  # times v Δt: under a force r⁻ⁿ the pole is ½ (n + 1) v Δt away, Δt before the end

Array = NDArray[np.float64]


def ending(scene: Scene, flow: Flow, stepper: Stepper, state: Array, time: float, spacing: float) -> tuple[float, str]:
    """Return when a trajectory ended (s), and at which border, in words; "" if it met none.

    The trajectory ends in the interval `spacing` after a time at which it was in `state`. Of a noisy one, that is the
    time, and the border is the one that motion without noise meets.
    """
    from vibrokit.symbolic.model import Model  # only here is SymPy needed

    started = time
    if flow is Flow.NOISY:
        stepper = single_stepper(scene, Flow.STATE)
    for _ in range(_ROUNDS):
        spacing /= _PARTS
        path = record(scene, Flow.STATE, stepper, state, time, spacing, _PARTS)
        state, time = path[-1], time + spacing * min(len(path) - 1, _PARTS - 1)
    border = Model(scene).border_ahead(state.tolist(), time, _REACH * spacing)
    return started if flow is Flow.NOISY else time, border
