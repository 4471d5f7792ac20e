"""AtIntensity: what is found at one noise intensity, and how far its rates may be wrong."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.sgcm.committor import Committor
from vibrokit.analyzers.sgcm.cores import CoreSets
from vibrokit.analyzers.sgcm.density_grid import DensityGrid, resolved
from vibrokit.analyzers.sgcm.quasi_stationary import QuasiStationary, Transition

COARSER = 1.5
"""Factor by which nodes are farther apart, steps longer and cores larger in a second solution.

Its whole difference contains an error of an order from 1.7 on; one of first order is twice the difference.
"""
# Of errors of the grid. On a tube between stiff stops (ω_n 250.7 s⁻¹, ζ 0.008, D = 4e-4), ln of the mean exit time is
# too large by 0.58, 0.29 by the committor with 200 and 280 nodes along each side, and by 1.46, 0.72 by the density.
_GAIN = 1.0 / (COARSER**2 - 1.0)
"""Times what a coarser grid changes: what ever closer nodes would change."""
_STEEPER = 1.1  # exponent with which depths grow as D falls: above the prefactors' share in hertz-0.570 at D = 1e-5

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True)
class Unresolved:
    """An intensity whose density cannot be resolved, and why."""

    intensity: float
    reason: str


@dataclasses.dataclass(frozen=True, eq=False)
class AtIntensity:
    """The density that has not left an attractor, and how fast it leaves, at one intensity.

    Attributes
    ----------
    intensity : float
    grid : DensityGrid
    found : QuasiStationary
    transition : Transition
    cores : CoreSets
    committors : mapping of int to Committor
        By target.
    coarser : AtIntensity or None
        The same on a coarser grid.
    rougher : QuasiStationary or None
        The density on that grid with fewer steps and larger cores or coarser basins.
    sharp : bool
        Whether sets with an edge absorb, so that errors of steps and sets are of first order.
    """

    intensity: float
    grid: DensityGrid
    found: QuasiStationary
    transition: Transition
    cores: CoreSets
    committors: Mapping[int, Committor] = dataclasses.field(default_factory=dict)
    coarser: AtIntensity | None = None
    rougher: QuasiStationary | None = None
    sharp: bool = False

    @property
    def log_rates(self) -> dict[int, float]:
        """By target: ln of the probability that leaves in one section interval, the mean of density and committor."""
        return {target: float(self._extrapolated(target).mean()) for target in self.committors}

    @property
    def errors(self) -> dict[int, float]:
        """By target: error estimate of ln rate.

        It is the difference of density and committor, plus what a coarser grid changes, plus what fewer steps and
        larger cores change, plus what iteration leaves.
        """
        return {target: self._error(target) for target in self.committors}

    def _error(self, target: int) -> float:
        if self.coarser is None or self.rougher is None:
            return math.inf
        own, coarse = self._pair(target), self.coarser._pair(target)
        if not np.isfinite([*own, *coarse]).all():
            return math.inf
        rough = self.rougher.log_rates.get(target, math.inf)
        of_sets = abs(rough - self.coarser.found.log_rates[target])
        of_grid = abs(float((own - coarse).mean()))
        of_method = abs(float(np.diff(self._extrapolated(target))[0]))
        first_order = 1.0 / (COARSER - 1.0) if self.sharp else 1.0
        of_iteration = (1.0 + _GAIN) * self._change(target) + _GAIN * self.coarser._change(target)
        return of_method + of_grid + first_order * of_sets + of_iteration

    def _extrapolated(self, target: int) -> Array:
        """ln of both rates, by the density and by the committor, as they tend to with ever closer nodes."""
        own = self._pair(target)
        coarse = own if self.coarser is None else self.coarser._pair(target)
        if not np.isfinite([*own, *coarse]).all():
            return own
        extrapolated: Array = own + _GAIN * (own - coarse)
        return extrapolated

    def _pair(self, target: int) -> Array:
        """ln of both rates on the own grid; NaN where there is none."""
        if target not in self.committors:
            return np.full(2, np.nan)
        return np.array([self.found.log_rates[target], self.committors[target].log_rate])

    def _change(self, target: int) -> float:
        """What iteration leaves of the mean of both rates on the own grid."""
        return 0.5 * (self.found.change + self.committors[target].change)

    @property
    def converged(self) -> bool:
        """Whether all iterations have ended by themselves."""
        return self.found.converged and all(c.converged for c in self.committors.values())

    @property
    def log_density(self) -> Array:
        """ln p; NaN where it is not resolved, because it is at the floor."""
        return resolved(self.found.phi)

    @property
    def at_edge(self) -> float:
        """ln of the probability at the outermost nodes."""
        phi = self.found.phi
        outermost = np.ones(phi.shape, dtype=bool)
        outermost[1:-1, 1:-1] = False
        return self.grid.mass(phi, outermost)

    def begun(self, grid: DensityGrid, intensity: float) -> tuple[Array, dict[int, Array]]:
        """Return ln p and, by target, ln of the committor to begin iteration from on another grid, at less noise.

        The shape of −D ln p and of −D ln c depends little on D. Both begin lower than that: what is missing arrives
        sooner than what is too much leaves, which may stay near a saddle for long.
        """
        ratio = (self.intensity / intensity) ** _STEEPER
        committors = {target: grid.resampled(c.log_values, self.grid) * ratio for target, c in self.committors.items()}
        return grid.resampled(self.found.phi, self.grid) * ratio, committors
