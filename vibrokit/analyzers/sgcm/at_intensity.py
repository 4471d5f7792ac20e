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

COARSER = math.sqrt(2.0)
"""Factor by which nodes are farther apart in a second solution.

What that changes is once an error of second order, and three times one of fourth order.
"""
FEWER = 1.5
"""Factor by which steps are longer in a third solution, at least: they are even."""
LARGER = 1.5
"""Factor by which cores are larger, to see whether limits of weak noise depend on their size."""
NEARER = math.sqrt(2.0)
"""Factor by which states are committed nearer to the edge of a basin, to see whether some return from there."""
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
    fewer_steps : mapping of int to Committor
        On that grid, with fewer steps.
    other_sets : mapping of int to Committor
        On that grid, with larger cores or coarser basins; empty if position decides.
    sets_resolved : bool
        Whether the sets that absorb are as they are defined, so that others give another number. Otherwise what they
        change is an error: basins are known by cells.
    nearer : mapping of int to Committor or None
        On that grid, with states that are committed nearer to the edges of basins; None if none are by their basin.
    """

    intensity: float
    grid: DensityGrid
    found: QuasiStationary
    transition: Transition
    cores: CoreSets
    committors: Mapping[int, Committor] = dataclasses.field(default_factory=dict)
    coarser: AtIntensity | None = None
    fewer_steps: Mapping[int, Committor] = dataclasses.field(default_factory=dict)
    other_sets: Mapping[int, Committor] = dataclasses.field(default_factory=dict)
    sets_resolved: bool = True
    nearer: Mapping[int, Committor] | None = None

    @property
    def log_rates(self) -> dict[int, float]:
        """By target: ln of the probability that leaves in one section interval for good."""
        return {target: known.log_rate for target, known in self.committors.items()}

    @property
    def errors(self) -> dict[int, float]:
        """By target: error estimate of ln rate, the sum of the changes that are errors and of what iteration leaves."""
        of_rates = slice(3 if self.sets_resolved else 4)
        return {
            target: float(np.abs(self.changes(target)[of_rates]).sum()) + known.change
            for target, known in self.committors.items()
        }

    def changes(self, target: int) -> Array:
        """Return by how much ln rate changes in four ways, each with its sign, shape (4,); inf where not known.

        They are nodes farther apart, fewer steps, states that are committed nearer to the edge of a basin, and other
        cores or coarser basins.
        """
        coarse = _log_rate({} if self.coarser is None else self.coarser.committors, target)
        of_sets = _log_rate(self.other_sets, target) - coarse if self.cores.others else 0.0
        found = [
            _log_rate(self.committors, target) - coarse,
            coarse - _log_rate(self.fewer_steps, target),
            0.0 if self.nearer is None else coarse - _log_rate(self.nearer, target),
            of_sets,
        ]
        return np.nan_to_num(found, nan=math.inf, neginf=math.inf)

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


def _log_rate(committors: Mapping[int, Committor], target: int) -> float:
    return committors[target].log_rate if target in committors else math.nan
