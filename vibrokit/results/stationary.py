"""StationaryWeights: how the long run of weak noise is shared out between attractors."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
from numpy.typing import NDArray


@dataclasses.dataclass(frozen=True, eq=False)
class StationaryWeights:
    """Shares of time that the motion spends at each attractor, in the long run, by their exponents alone.

    Attributes
    ----------
    labels : tuple of int
    intensity : float
        Noise intensity D (m² s⁻³).
    weights : array (count,)
        Sum 1; NaN where they are not known.
    lower, upper : array (count,)
        Bounds of each that follow from those of the energies. Prefactors are in none of them.
    """

    labels: tuple[int, ...]
    intensity: float
    weights: NDArray[np.float64]
    lower: NDArray[np.float64]
    upper: NDArray[np.float64]

    def __str__(self) -> str:
        if np.isnan(self.weights).any():
            return f"Stationary weights at D = {self.intensity:g} are not known."
        rows = zip(self.labels, self.weights, self.lower, self.upper, strict=True)
        shares = ", ".join(f"{label}: {_shown(value, low, high)}" for label, value, low, high in rows)
        return (
            f"Stationary weights at D = {self.intensity:g}: {shares}. Prefactors are left out, which may change them "
            "by any factor that does not grow as D → 0."
        )


def _shown(value: float, low: float, high: float) -> str:
    return f"{value:.3g}" if math.isclose(low, high, rel_tol=1e-3) else f"{value:.3g} ({low:.2g}–{high:.2g})"
