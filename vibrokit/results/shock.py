"""Shock: the smallest sudden change of state that leaves a basin."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray


@dataclasses.dataclass(frozen=True, eq=False)
class Shock:
    """The smallest sudden change of state that leaves a basin.

    Attributes
    ----------
    source, target : int
        Labels of the attractor whose state changes, and of the attractor that is reached.
    size : float
        √((ω_n Δx)² + Δv²) (m s⁻¹); ``|Δv|`` for a change of velocity alone.
    error : float
        How much smaller the smallest one may be: the last step of the search (m s⁻¹).
    kick : array (2,)
        Δx (m) and Δv (m s⁻¹).
    state : array (n,)
        The state before the change.
    time : float
        Time after the section (s).
    """

    source: int
    target: int
    size: float
    error: float
    kick: NDArray[np.float64]
    state: NDArray[np.float64]
    time: float


@dataclasses.dataclass(frozen=True, eq=False)
class ShapeStability:
    """Stability of an attractor by the shape of its basin, to compare with its activation energy.

    Attributes
    ----------
    label : int
    basin_fraction, basin_fraction_error : float
    velocity_kick : Shock or None
        The smallest change of v alone; None if none up to the size of the region leaves the basin.
    any_kick : Shock or None
        The smallest change of x and v.
    """

    label: int
    basin_fraction: float
    basin_fraction_error: float
    velocity_kick: Shock | None
    any_kick: Shock | None
