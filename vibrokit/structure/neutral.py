"""Places that no force determines: a mass that nothing holds, and motions that are one of a family.

A mass without a spring rests anywhere, or moves about any place, where nothing touches it. Such a motion attracts none
beside it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import StructureError
from vibrokit.oscillator import Oscillator

_ROUNDING = 1e-10  # of a multiplier: nearer to 1 than this a deviation neither grows nor falls


def refuse_unheld(osc: Oscillator) -> None:
    """Raise StructureError if no force of a scene depends on x."""
    model = osc.model
    if not osc.barriers and model.state[0] not in model.smooth_force.subs(model.numbers).free_symbols:
        raise StructureError(
            "no force of the scene depends on x, so that nothing holds the mass: its motion from one place is the same "
            "from every other, and there are no attractors; give it a spring or stops."
        )


def is_neutral(multipliers: NDArray[np.complex128]) -> bool:
    """Whether some deviation from a motion stays as it is, so that the motion is one of a family."""
    return bool(np.abs(multipliers - 1.0).min() < _ROUNDING)
