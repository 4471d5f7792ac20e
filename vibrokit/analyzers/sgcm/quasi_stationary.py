"""Quasi-stationary densities: how states are distributed that last came from an attractor, and how fast they leave.

What leaves is put back into the core of the attractor. So the density stays the same, and what leaves in a section
interval is the inverse of the mean exit time from the core, also where exits are no rare events. Where they are rare,
the density is that of states that have not left.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.sgcm.cores import CoreSets
from vibrokit.analyzers.sgcm.density_flow import ABSORBED
from vibrokit.analyzers.sgcm.density_grid import DensityGrid
from vibrokit.analyzers.sgcm.propagator import Propagator
from vibrokit.progress import advance, stage

_BELOW = 15.0  # in ln p: the floor lies that far below the density that leaves, so that it adds e⁻¹⁵ of it
_RAREST = 35.0  # in ln rate: exits that are rarer than the most frequent one by more are not resolved

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True)
class Convergence:
    """When the iteration of a rate over section intervals ends.

    Attributes
    ----------
    relaxation : float
        Section intervals in which deviations of the density fall by a factor e.
    tolerance : float
        Change of ln rate that may be left.
    crossed : float
        Relaxations in which what is missing at the start arrives from the attractor: before, a rate may rest.
    window : int
        Section intervals, at least: the changes of means over windows give how fast changes fall.
    still : float
        Means of ln rate that differ by less are equal, as errors of rates are above 1e-2.
    """

    relaxation: float
    tolerance: float
    crossed: float = 4.0
    window: int = 4
    still: float = 1e-3

    def goes_on(self, rates: list[float]) -> bool:
        """Whether more is left than tolerated; after 40 relaxations iteration is given up."""
        return len(rates) < int(np.clip(40 * self.relaxation, 60, 3000)) and not self.reached(rates)

    def reached(self, rates: list[float]) -> bool:
        """Whether so little is left as is tolerated."""
        return self.remaining(rates) <= self.tolerance

    def remaining(self, rates: list[float]) -> float:
        """Return the change of the last of some ln rates that further iteration would make.

        It is the sum of a geometric series of the means of three windows, as wide as half of the relaxation, since a
        rate may change little for shorter times by chance, or cycle between limits of interpolation. Its ratio is not
        below the square of that of the slowest mode around the attractor, because the covariance of a density relaxes
        twice as fast as its mean; it is above where a density takes longer to arrive than to relax.
        """
        window = max(self.window, math.ceil(0.5 * self.relaxation))
        last = rates[-3 * window :]
        if len(rates) < max(3 * window, self.crossed * self.relaxation) or not np.isfinite(last).all():
            return math.inf
        before, now = np.abs(np.diff(np.reshape(last, (3, window)).mean(axis=1))).tolist()
        if max(before, now) <= self.still:
            return float(now)
        ratio = max(now / before, math.exp(-2 * window / self.relaxation)) if before > 0 else 1.0
        return float(now * ratio / (1 - ratio)) if ratio < 1 else math.inf

    def error(self, rates: list[float]) -> float:
        """Return an error of the last of some ln rates: the change that is left, and half of how far they vary."""
        last, change = np.array(rates[-2 * self.window :]), self.remaining(rates)
        varies = 0.5 * float(np.ptp(last)) if np.isfinite(last).all() else math.inf
        return (change if math.isfinite(change) else 2.0 * varies) + varies


@dataclasses.dataclass(frozen=True, eq=False)
class QuasiStationary:
    """The density of states that last came from the attractor.

    Attributes
    ----------
    propagator : Propagator
    cores : CoreSets
    phi : array (nx, nv)
        ln p on the section; its probability is 1.
    highest : array (nx, nv)
        Largest ln p at each node over the last section interval.
    log_rates : mapping of int to float
        By target: ln of the probability that leaves in one section interval.
    in_core : array (nx, nv)
        ln of the probability at each node that is in the own core, or has been put back there; −∞ elsewhere.
    level : float
        ln p where most of it leaves.
    change : float
        Error of the largest rate's logarithm that iteration leaves.
    converged : bool
        Whether iteration has ended by itself.
    drift : float
        Relative change of the probability in one section interval by truncation errors, before it is normalized.
    intervals : int
    """

    propagator: Propagator
    cores: CoreSets
    phi: Array
    highest: Array
    log_rates: Mapping[int, float]
    in_core: Array
    level: float
    change: float
    converged: bool
    drift: float
    intervals: int

    @property
    def grid(self) -> DensityGrid:
        """The nodes."""
        return self.propagator.grid

    @property
    def top(self) -> float:
        """ln p where most of it leaves, or at the maximum if that is less."""
        return min(self.level, float(self.highest.max()))

    def among(self, cores: CoreSets) -> QuasiStationary:
        """Return the same density with other cores on its grid."""
        if cores.own is self.cores.own:
            return dataclasses.replace(self, cores=cores)
        with np.errstate(divide="ignore"):
            return dataclasses.replace(self, cores=cores, in_core=self.phi + np.log(cores.own * self.grid.areas))


def quasi_stationary(
    propagator: Propagator, start: Array, cores: CoreSets, convergence: Convergence
) -> QuasiStationary:
    """Iterate from ln p at the start, an array (nx, nv), until the rates stay the same."""
    grid, rates = propagator.grid, list[float]()
    phi, entry = start - grid.mass(start), cores.entry - grid.mass(cores.entry)
    floor = float(phi.max()) - 2 * _BELOW
    with np.errstate(divide="ignore"):
        own = np.log(cores.own * grid.areas)
    with stage("density", unit="section intervals"):
        while convergence.goes_on(rates):
            highest = np.full_like(phi, -np.inf)
            phi, lost = propagator.interval(phi, floor, highest)
            empty = phi <= floor
            mass, log_rates, levels = _absorb(phi, lost, cores, grid)
            kept = grid.mass(phi)
            phi, highest = phi - kept, highest - kept
            rates.append(max(log_rates.values()))
            level, least = max(levels.values()) - kept, min(levels.values()) - kept
            if math.isfinite(level):  # otherwise nothing has reached an exit yet
                floor = max(least, level - _RAREST) - _BELOW
            phi = np.where(empty, floor, np.maximum(phi, floor))
            in_core = phi + own
            left = min(math.exp(np.logaddexp.reduce(list(log_rates.values()))), 1.0)
            if left > 0:
                remains, put_back = math.log1p(-left * ABSORBED), entry + math.log(left)
                in_core = np.logaddexp(in_core + remains, put_back + np.log(grid.areas))
                phi = np.logaddexp(phi + remains, put_back)
            advance()
    resolved = {target: rate for target, rate in log_rates.items() if levels[target] - kept > floor + 0.5 * _BELOW}
    return QuasiStationary(
        propagator, cores, phi, highest, resolved, in_core, level, convergence.error(rates),
        convergence.reached(rates), math.expm1(mass), len(rates),
    )  # fmt: skip


def _absorb(
    phi: Array, lost: float, cores: CoreSets, grid: DensityGrid
) -> tuple[float, dict[int, float], dict[int, float]]:
    """Take what has left out of φ, in place; `lost` is ln of what position took before.

    Returns ln of all probability, and by target ln of the share that left and ln p where it left.
    """
    mass, log_rates, levels = grid.mass(phi), dict[int, float](), dict[int, float]()
    if cores.outlet is not None:
        mass = float(np.logaddexp(mass, lost))
        log_rates[cores.outlet] = lost - mass
        levels[cores.outlet] = lost - float(np.log(np.broadcast_to(grid.areas, grid.shape).sum()))
    for target, covered in cores.others.items():
        held = covered > 0
        share = np.where(held, covered, 1.0) * ABSORBED
        leaving = phi + np.log(share)
        leaves = grid.mass(leaving, held)
        log_rates[target], levels[target] = leaves - mass, grid.mass(leaving + phi, held) - leaves
        phi[held] += np.log1p(-share[held])
    return mass, log_rates, levels
