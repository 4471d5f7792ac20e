"""Noise intensities at which rates are computed, and settings of the analyzers for a wanted accuracy."""

from __future__ import annotations

import dataclasses
import math

from vibrokit.analyzers.analyzer import Analyzer
from vibrokit.analyzers.least_action import LeastAction
from vibrokit.analyzers.mean_exit_times import MFET

_RUNGS = ((0.05, (4.0, 7.0, 12.0)), (0.0, (4.0, 7.0, 12.0, 20.0)))
"""Least accuracy, and the values of ΔU/D at which rates are then computed: direct simulation is cheap up to 7,
splitting up to 20, and the nodes resolve a density up to about 15."""
_SIMULATED = (0.25, 25.0)  # ΔU/D between which the scene's own intensity is added: below, no state is metastable
_APART = 1.25  # ratio below which two intensities count as one
_LEAST_ERROR, _LARGEST_ERROR = 0.002, 0.25  # of a simulated rate: 250 000 and 16 exits
_REPLICAS = 32  # of splitting at a relative error of 0.1: its default of 128 replicas reaches 0.05


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


def fitted(analyzer: Analyzer, accuracy: float) -> Analyzer:
    """Return an analyzer with settings for an accuracy: a relative error of the bounds of ΔU and of mean times.

    The error of a simulated rate is half of the accuracy, so that its 95 % interval is as wide as that. The other
    methods choose their own effort from the scene; `LeastAction` refines its graph to the accuracy.
    """
    if isinstance(analyzer, LeastAction):
        return dataclasses.replace(analyzer, accuracy=accuracy)
    if isinstance(analyzer, MFET):
        error = min(max(accuracy / 2, _LEAST_ERROR), _LARGEST_ERROR)
        return dataclasses.replace(
            analyzer, target_error=error, replicas=max(16, math.ceil(_REPLICAS * (0.1 / error) ** 2))
        )
    return analyzer
