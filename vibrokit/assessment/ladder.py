"""Noise intensities at which rates are computed."""

from __future__ import annotations

import math

_RUNGS = ((0.05, (4.0, 7.0, 12.0)), (0.0, (4.0, 7.0, 12.0, 20.0)))
"""Least accuracy, and the values of ΔU/D at which rates are then computed: direct simulation is cheap up to 7,
splitting up to 20, and the nodes resolve a density up to about 15."""
_SIMULATED = (0.25, 25.0)  # ΔU/D between which the scene's own intensity is added: below, no state is metastable
_APART = 1.25  # ratio below which two intensities count as one


def ladder(energy: float, intensity: float, accuracy: float) -> tuple[float, ...]:
    """Return the noise intensities for one state, descending (m² s⁻³).

    Parameters
    ----------
    energy : float
        ΔU of its cheapest exit.
    intensity : float
        D of the scene, which is one of them if its ΔU/D is between 0.25 and 25.
    accuracy : float
    """
    ratios: tuple[float, ...] = next(ratios for least, ratios in _RUNGS if accuracy >= least)
    own = energy / intensity
    if _SIMULATED[0] <= own <= _SIMULATED[1]:
        ratios = (*(one for one in ratios if abs(math.log(one / own)) > math.log(_APART)), own)
    return tuple(intensity if ratio == own else energy / ratio for ratio in sorted(ratios))
