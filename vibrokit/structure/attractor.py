"""Attractor: one steady state of the noise-free system."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray


@dataclasses.dataclass(frozen=True, eq=False)
class Attractor:
    """A steady state.

    Attributes
    ----------
    label : int
        Its place among the attractors of a structure, and its label in the basin grid.
    kind : str
        ``"periodic"`` or ``"equilibrium"``.
    period : int
        In forcing periods; 1 for an equilibrium.
    points : array (period, n)
        Its points on the section, in the order in which they are visited.
    multipliers : complex array (n,)
        Eigenvalues of the map over one period of the orbit; of the flow over 2π/ω_n for an equilibrium.
    impacts : int
        Stop hits per orbit.
    hits : tuple of int
        The same for each stop of the scene apart.
    basin_fraction : float
        Share of the region's cells that lead to it.
    basin_fraction_error : float
        Its standard error, as if the cells were independent draws.
    residual : float
        Distance between the first point and its image after `period` periods.
    """

    label: int
    kind: str
    period: int
    points: NDArray[np.float64]
    multipliers: NDArray[np.complex128]
    impacts: int
    hits: tuple[int, ...]
    basin_fraction: float
    basin_fraction_error: float
    residual: float
