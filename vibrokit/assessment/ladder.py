"""Noise intensities at which rates are computed."""

from __future__ import annotations

import math
from collections.abc import Sequence

_RATIOS = 4.0, 7.0, 12.0
"""ΔU/D at which rates are computed: direct simulation is cheap up to 7, splitting and densities are up to about 15.

A fourth at 20 would take two thirds of the time at an accuracy of 0.03, on a double well of damping 0.2.
"""
_SIMULATED = (0.25, 25.0)  # ΔU/D between which the scene's own intensity is added: below, no state is metastable
_APART = 1.25  # ratio below which two intensities count as one


def barrier(energies: Sequence[float], intensity: float) -> float:
    """Return the least ΔU of a state's exits that its noise takes time to climb, or of all; infinite without any.

    What is passed at once leads to no other state, so that mean times at still weaker noise are no answer.
    """
    held = [energy for energy in energies if energy >= _SIMULATED[0] * intensity]
    return min(held or energies, default=math.inf)


def ladder(energy: float, intensity: float) -> tuple[float, ...]:
    """Return the noise intensities for one state, descending (m² s⁻³); that of the scene is one if in their range."""
    ratios: tuple[float, ...] = _RATIOS
    own = energy / intensity
    if _SIMULATED[0] <= own <= _SIMULATED[1]:
        ratios = (*(one for one in ratios if abs(math.log(one / own)) > math.log(_APART)), own)
    return tuple(intensity if ratio == own else energy / ratio for ratio in sorted(ratios))
