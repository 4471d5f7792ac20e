"""AtIntensity: what is found at one noise intensity, and how far its rates may be wrong."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.sgcm.committor import Committor
from vibrokit.analyzers.sgcm.density_grid import DensityGrid, resolved
from vibrokit.analyzers.sgcm.quasi_stationary import QuasiStationary

Array = NDArray[np.float64]
Committors = Mapping[int, Committor]


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
    density : QuasiStationary
    committors : mapping of int to Committor
        By target.
    coarser : AtIntensity or None
        The same on a coarser grid.
    fewer_steps : mapping of int to Committor
        On that grid, with fewer steps.
    other_edges : mapping of int to Committor or None
        On that grid, with states that are committed nearer to the edges of basins, or with coarser cells of basins
        that count themselves; None if no basin counts.
    larger_cores : mapping of int to Committor or None
        On that grid, with larger cores; None if no core of another attractor counts. Cores are defined, so that what
        this changes is no error of a rate.
    """

    density: QuasiStationary
    committors: Committors
    coarser: AtIntensity | None = None
    fewer_steps: Committors = dataclasses.field(default_factory=dict)
    other_edges: Committors | None = None
    larger_cores: Committors | None = None

    @property
    def intensity(self) -> float:
        """D (m² s⁻³)."""
        return self.density.propagator.intensity

    @property
    def grid(self) -> DensityGrid:
        """The nodes."""
        return self.density.grid

    @property
    def log_rates(self) -> dict[int, float]:
        """By target: ln of the probability that leaves in one section interval for good."""
        return {target: known.log_rate for target, known in self.committors.items()}

    @property
    def errors(self) -> dict[int, float]:
        """By target: error estimate of ln rate, the sum of the changes that are errors and of what iteration leaves."""
        return {
            target: float(np.abs(self.changes(target)[:3]).sum()) + known.change
            for target, known in self.committors.items()
        }

    def changes(self, target: int) -> Array:
        """Return by how much ln rate changes in four ways, each with its sign, shape (4,); inf where not known.

        They are nodes farther apart, fewer steps, other edges of basins, and larger cores.
        """
        coarse = _log_rate({} if self.coarser is None else self.coarser.committors, target)
        found = [_log_rate(self.committors, target) - coarse] + [
            0.0 if each is None else coarse - _log_rate(each, target)
            for each in (self.fewer_steps, self.other_edges, self.larger_cores)
        ]
        return np.where(np.isfinite(found), found, math.inf)

    @property
    def converged(self) -> bool:
        """Whether all iterations have ended by themselves."""
        return self.density.converged and all(c.converged for c in self.committors.values())

    @property
    def log_density(self) -> Array:
        """ln p; NaN where it is not resolved, because it is at the floor."""
        return resolved(self.density.phi)

    @property
    def at_edge(self) -> float:
        """ln of the probability at the outermost nodes."""
        outermost = np.ones(self.grid.shape, dtype=bool)
        outermost[1:-1, 1:-1] = False
        return self.grid.mass(self.density.phi, outermost)

    def begun(self, grid: DensityGrid, intensity: float) -> tuple[Array, dict[int, Array]]:
        """Return ln p and, by target, ln of the committor to begin iteration from on another grid, at less noise.

        The shape of −D ln p and of −D ln c depends little on D. Iteration starts from an underestimate: a deficit fills
        faster than an excess drains, which may stay near a saddle for long. So depths grow as D^−1.1.
        """
        ratio = (self.intensity / intensity) ** 1.1  # above the prefactors' share in hertz-0.570 at D = 1e-5
        known = {target: grid.resampled(c.log_values, self.grid) * ratio for target, c in self.committors.items()}
        return grid.resampled(self.density.phi, self.grid) * ratio, known


def _log_rate(committors: Committors, target: int) -> float:
    return committors[target].log_rate if target in committors else math.nan
