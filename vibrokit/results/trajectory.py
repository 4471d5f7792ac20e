"""Trajectory: states at equally spaced times."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclasses.dataclass(frozen=True, eq=False)
class Trajectory:
    """A trajectory at equally spaced times.

    Attributes
    ----------
    t : array (count,)
        Times (s).
    states : array (count, n)
        Displacement (m), velocity (m s⁻¹), extra noise states.
    stops : tuple of float
        Places of the stops (m), for pictures.
    """

    t: NDArray[np.float64]
    states: NDArray[np.float64]
    stops: tuple[float, ...] = ()

    @property
    def x(self) -> NDArray[np.float64]:
        """Displacement (m)."""
        return self.states[:, 0]

    @property
    def v(self) -> NDArray[np.float64]:
        """Velocity (m s⁻¹)."""
        return self.states[:, 1]

    def plot(self, ax: Any = None) -> Any:
        """Draw the phase portrait; see `vibrokit.plots.portraits.phase_portrait`."""
        from vibrokit.plots.portraits import phase_portrait

        return phase_portrait(self.x, self.v, stops=self.stops, ax=ax)
