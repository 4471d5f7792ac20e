"""StationaryWeights: the shares of time that weak noise spends at each attractor."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray


@dataclasses.dataclass(frozen=True, eq=False)
class StationaryWeights:
    """Shares of time spent at each attractor in the long run, from their exponents alone.

    Attributes
    ----------
    names : tuple of str
        Of the attractors, in the order of their labels.
    intensity : float
        Noise intensity D (m² s⁻³).
    weights : array (count,)
        Sum 1; NaN where they are not known.
    lower, upper : array (count,)
        Bounds of each, from those of the energies. They do not include the unknown prefactors.
    """

    names: tuple[str, ...]
    intensity: float
    weights: NDArray[np.float64]
    lower: NDArray[np.float64]
    upper: NDArray[np.float64]

    def __str__(self) -> str:
        if np.isnan(self.weights).any():
            return f"Stationary weights at D = {self.intensity:g} are not known."
        rows = zip(self.names, self.weights, self.lower, self.upper, strict=True)
        shares = ", ".join(f"{name} {_shown(*numbers)}" for name, *numbers in rows)
        return f"Stationary weights at D = {self.intensity:g}, without prefactors: {shares}."


def _shown(value: float, low: float, high: float) -> str:
    return f"{value:.3g}" if np.isclose(low, high, rtol=1e-3, atol=0) else f"{value:.3g} ({low:.2g} to {high:.2g})"
