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
# Times what a coarser grid changes: what ever closer nodes change if errors are of second order, as at the edges of
# thin basins. On a tube between stiff stops (ω_n 250.7 s⁻¹, ζ 0.008, D = 4e-4), ln of the mean exit time is too large
# by 0.58, 0.29 by the committor with 200 and 280 nodes along each side, and by 1.46, 0.72 by the density.
_MOST_GAIN = 1.0 / (COARSER**2 - 1.0)
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
        """By target: ln of the probability that leaves in one section interval, the mean of density and committor.

        Both are extrapolated to closer nodes, by as much as brings them together.
        """
        return {target: float(self._extrapolated(target).mean()) for target in self.committors}

    @property
    def errors(self) -> dict[int, float]:
        """By target: error estimate of ln rate, the sum of what `changes` has and of what iteration leaves."""
        return {
            target: float(np.abs(self.changes(target)).sum()) + self.iteration_error(target)
            for target in self.committors
        }

    def changes(self, target: int) -> Array:
        """Return by how much ln rate changes in three ways, each with its sign, shape (3,); inf where not known.

        It is the difference of density and committor, what a coarser grid changes, and what fewer steps together with
        larger cores, or coarser basins, change.
        """
        own, coarse = self._pair(target), self._coarse_pair(target)
        if self.rougher is None or not np.isfinite([*own, *coarse]).all():
            return np.full(3, np.inf)
        of_sets = self.rougher.log_rates.get(target, math.inf) - coarse[0]
        first_order = 1.0 / (COARSER - 1.0) if self.sharp else 1.0
        return np.array([_gap(self._extrapolated(target)), (own - coarse).mean(), first_order * of_sets])

    def iteration_error(self, target: int) -> float:
        """Return the error of ln rate that iteration leaves."""
        of_coarser = 0.0 if self.coarser is None else self.coarser._change(target)
        return (1.0 + _MOST_GAIN) * self._change(target) + _MOST_GAIN * of_coarser

    def _extrapolated(self, target: int) -> Array:
        """ln of both rates, by the density and by the committor, extrapolated from both grids."""
        own, coarse = self._pair(target), self._coarse_pair(target)
        if not np.isfinite([*own, *coarse]).all():
            return own
        closes = _gap(coarse) - _gap(own)
        gain = float(np.clip(_gap(own) / closes, 0.0, _MOST_GAIN)) if closes else 0.0
        extrapolated: Array = own + gain * (own - coarse)
        return extrapolated

    def _coarse_pair(self, target: int) -> Array:
        return np.full(2, np.nan) if self.coarser is None else self.coarser._pair(target)

    def _pair(self, target: int) -> Array:
        """ln of both rates on the own grid; NaN where there is none."""
        if target not in self.committors:
            return np.full(2, np.nan)
        return np.array([self.found.log_rates[target], self.committors[target].log_rate])

    def _change(self, target: int) -> float:
        """What iteration leaves of the mean of both rates on the own grid."""
        known = self.committors.get(target)
        return math.inf if known is None else 0.5 * (self.found.change + known.change)

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


def _gap(pair: Array) -> float:
    """By how much the density's ln rate is above the committor's."""
    return float(pair[0] - pair[1])
