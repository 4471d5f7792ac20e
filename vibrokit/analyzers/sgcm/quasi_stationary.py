"""Quasi-stationary densities: how probability is distributed that has not left yet, and how fast it leaves."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.sgcm.propagator import ABSORBED, Propagator
from vibrokit.progress import advance, stage

_CONVERGED = 3e-3  # change of ln rate that is left; the error of 200² nodes is larger
_INTERVALS_PER_RELAXATION, _FEWEST, _MOST = 40, 60, 3000  # section intervals after which iteration is given up
_BELOW = 25.0  # in ln p: the floor lies that far below the density that leaves, so that it adds e⁻²⁵ of the rate
_RAREST = 35.0  # in ln rate: exits that are rarer than the most frequent one by more are not resolved

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class QuasiStationary:
    """A density that keeps its shape while probability leaves it.

    Attributes
    ----------
    phi : array (nx, nv)
        ln p on the section; its probability is 1.
    highest : array (nx, nv)
        Largest ln p at each node over the last section interval.
    log_rates : mapping of int to float
        By target: ln of the probability that leaves in one section interval.
    level : float
        ln p where most of it leaves.
    change : float
        Change of the largest rate's logarithm that further iteration would make, estimated from the last ones.
    drift : float
        Relative change of the probability in one section interval by truncation errors, before it is normalized.
    intervals : int
    """

    phi: Array
    highest: Array
    log_rates: Mapping[int, float]
    level: float
    change: float
    drift: float
    intervals: int

    @property
    def converged(self) -> bool:
        """Whether iteration has ended by itself."""
        return self.change <= _CONVERGED


def quasi_stationary(
    propagator: Propagator, start: Array, sets: Mapping[int, Array], relaxation: float
) -> QuasiStationary:
    """Iterate until the rates stay the same.

    Parameters
    ----------
    propagator : Propagator
    start : array (nx, nv)
        ln p.
    sets : mapping of int to array (nx, nv)
        By target: how much of each cell belongs to the set that absorbs on the section. If empty, probability leaves
        by position, with target −1.
    relaxation : float
        Section intervals in which deviations of the density fall by a factor e.
    """
    grid = propagator.tables.grid
    phi, rates, change, intervals = start - grid.mass(start), list[float](), np.inf, 0
    most = int(np.clip(_INTERVALS_PER_RELAXATION * relaxation, _FEWEST, _MOST))
    remaining = 1 / -np.expm1(-1 / relaxation)  # sum of a geometric series of changes
    areas = {target: float(np.log((covered * grid.areas).sum())) for target, covered in sets.items()}
    areas = areas or {-1: float(np.log(np.broadcast_to(grid.areas, grid.shape).sum()))}
    floor, level, drift = phi.max() - 2 * _BELOW, -np.inf, 0.0
    log_rates: dict[int, float] = {}
    highest = np.empty_like(phi)
    with stage("density", unit="section intervals"):
        while intervals < most and change > _CONVERGED:
            highest = np.full_like(phi, -np.inf)
            phi, lost = propagator.interval(phi, floor, highest)
            mass = grid.mass(phi)
            if propagator.tables.crossed:
                mass = float(np.logaddexp(mass, lost))
                log_rates = {-1: lost - mass}
            drift = float(np.expm1(mass))
            for target, covered in sets.items():
                held = covered > 0
                share = np.where(held, covered, 1.0) * ABSORBED
                log_rates[target] = grid.mass(phi + np.log(share), held) - mass
                phi[held] += np.log1p(-share[held])
            kept = grid.mass(phi)
            phi, highest = phi - kept, highest - kept
            rates.append(max(log_rates.values()))
            level = max(log_rates[target] - areas[target] for target in areas)
            least = min(log_rates[target] - areas[target] for target in areas)
            floor = max(least, level - _RAREST) - _BELOW
            intervals += 1
            if intervals > 3 and np.isfinite(rates[-1]):
                change = max(abs(rates[-1] - rates[-2]), abs(rates[-2] - rates[-3])) * remaining
            advance()
    resolved = {target: rate for target, rate in log_rates.items() if rate - areas[target] > floor + 0.5 * _BELOW}
    return QuasiStationary(phi, highest, resolved, level, float(change), drift, intervals)
