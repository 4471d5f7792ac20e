"""Shock: the smallest kick that throws a steady state out of its basin."""

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
        Labels of the attractor that is kicked and of what the kicked state comes to.
    size : float
        √((ω_n Δx)² + Δv²) (m s⁻¹); |Δv| for a kick in velocity alone.
    error : float
        How much smaller the smallest one may be: the last step of the search (m s⁻¹).
    kick : array (2,)
        Δx (m) and Δv (m s⁻¹).
    state : array (n,)
        The state before the kick.
    time : float
        When it comes, after the section (s).
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
    """How stable an attractor is by the shape of its basin, for contrast with its activation energy.

    Attributes
    ----------
    label : int
    basin_fraction, basin_fraction_error : float
    velocity_kick : Shock or None
        The smallest kick in v alone; None if none up to the size of the region leaves the basin.
    any_kick : Shock or None
        The smallest kick in x and v.
    """

    label: int
    basin_fraction: float
    basin_fraction_error: float
    velocity_kick: Shock | None
    any_kick: Shock | None
