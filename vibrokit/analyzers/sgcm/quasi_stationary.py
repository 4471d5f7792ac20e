"""Quasi-stationary densities: how states are distributed that last came from an attractor, and how fast they leave.

What leaves is put back into the core of the attractor. So the density stays the same, and what leaves in a section
interval is the inverse of the mean exit time from the core, also where exits are no rare events. Where they are rare,
the density is that of states that have not left.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.sgcm.cores import CoreSets
from vibrokit.analyzers.sgcm.density_flow import ABSORBED
from vibrokit.analyzers.sgcm.density_grid import DensityGrid
from vibrokit.progress import advance, stage

_WINDOW = 4  # section intervals, at least: the largest changes of two windows give how fast they fall
_INTERVALS_PER_RELAXATION, _FEWEST, _MOST = 40, 60, 3000  # section intervals after which iteration is given up
CROSSED = 4.0
"""Relaxations, in which what is missing at the start arrives from the attractor: before, a rate may rest."""
_STILL = 1e-3  # of ln rate: means that differ by less are equal, as errors of rates are above 1e-2
_BELOW = 15.0  # in ln p: the floor lies that far below the density that leaves, so that it adds e⁻¹⁵ of it
_RAREST = 35.0  # in ln rate: exits that are rarer than the most frequent one by more are not resolved

Array = NDArray[np.float64]

Backward = Callable[[Array, float, float], Array]
"""From ln of an expected value, its floor and its value where position ends motion to the same an interval earlier."""


class Transition(Protocol):
    """What carries ln p over a section interval, and expected values back."""

    @property
    def grid(self) -> DensityGrid:
        """The nodes."""

    def interval(self, phi: Array, floor: float, highest: Array | None = None) -> tuple[Array, float]:
        """Return φ one section interval later, and the logarithm of the probability that left by position.

        φ is at least `floor`; `highest`, if given, keeps the largest φ at each node at all times in between.
        """

    def backward(self, density: QuasiStationary, cores: CoreSets) -> Backward:
        """Return what gives ln of an expected value one section interval earlier.

        It may leave out what a density does not reach outside the cores.
        """


@dataclasses.dataclass(frozen=True, eq=False)
class QuasiStationary:
    """The density of states that last came from the attractor.

    Attributes
    ----------
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

    phi: Array
    highest: Array
    log_rates: Mapping[int, float]
    in_core: Array
    level: float
    change: float
    converged: bool
    drift: float
    intervals: int


def quasi_stationary(
    transition: Transition,
    start: Array,
    cores: CoreSets,
    relaxation: float,
    converged: float,
    crossed: float = CROSSED,
) -> QuasiStationary:
    """Iterate until the rates stay the same.

    Parameters
    ----------
    transition : Transition
    start : array (nx, nv)
        ln p.
    cores : CoreSets
        Those of others absorb on the section.
    relaxation : float
        Section intervals in which deviations of the density fall by a factor e.
    converged : float
        Change of ln rate that may be left.
    crossed : float
        Relaxations that must pass.
    """
    grid = transition.grid
    phi, rates, change, intervals = start - grid.mass(start), list[float](), np.inf, 0
    most, sets = most_intervals(relaxation), cores.others
    everywhere = float(np.log(np.broadcast_to(grid.areas, grid.shape).sum()))
    levels: dict[int, float] = {}
    floor, level, drift = phi.max() - 2 * _BELOW, -np.inf, 0.0
    log_rates: dict[int, float] = {}
    highest = in_core = np.empty_like(phi)
    with np.errstate(divide="ignore"):
        own = np.log(cores.own * grid.areas)
    entry = cores.entry - grid.mass(cores.entry)
    with stage("density", unit="section intervals"):
        while intervals < most and change > converged:
            highest = np.full_like(phi, -np.inf)
            phi, lost = transition.interval(phi, floor, highest)
            empty = phi <= floor
            mass = grid.mass(phi)
            if cores.outlet is not None:
                mass = float(np.logaddexp(mass, lost))
                log_rates = {cores.outlet: lost - mass}
                levels[cores.outlet] = lost - everywhere
            drift = float(np.expm1(mass))
            for target, covered in sets.items():
                held = covered > 0
                share = np.where(held, covered, 1.0) * ABSORBED
                leaving = phi + np.log(share)
                log_rates[target] = grid.mass(leaving, held) - mass
                levels[target] = grid.mass(leaving + phi, held) - grid.mass(leaving, held)
                phi[held] += np.log1p(-share[held])
            kept = grid.mass(phi)
            phi, highest = phi - kept, highest - kept
            rates.append(max(log_rates.values()))
            level, least = max(levels.values()) - kept, min(levels.values()) - kept
            if math.isfinite(level):  # otherwise nothing has reached an exit yet
                floor = max(least, level - _RAREST) - _BELOW
            phi = np.where(empty, floor, np.maximum(phi, floor))
            left = min(math.exp(np.logaddexp.reduce(list(log_rates.values()))), 1.0) if log_rates else 0.0
            in_core = phi + own
            if left > 0:
                remains = math.log1p(-left * ABSORBED)
                in_core = np.logaddexp(in_core + remains, entry + np.log(grid.areas) + math.log(left))
                phi = np.logaddexp(phi + remains, entry + math.log(left))
            intervals += 1
            change = remaining(rates, relaxation, crossed)
            advance()
    resolved = {target: rate for target, rate in log_rates.items() if levels[target] - kept > floor + 0.5 * _BELOW}
    error = spread_of(rates, change)
    return QuasiStationary(phi, highest, resolved, in_core, level, error, change <= converged, drift, intervals)


def most_intervals(relaxation: float) -> int:
    """Return after how many section intervals iteration is given up."""
    return int(np.clip(_INTERVALS_PER_RELAXATION * relaxation, _FEWEST, _MOST))


def remaining(rates: list[float], relaxation: float, crossed: float = CROSSED) -> float:
    """Return the change of the last of some ln rates that further iteration would make.

    It is the sum of a geometric series of the means of three windows, as wide as half of the relaxation, since a rate
    may change little for shorter times by chance, or cycle between limits of interpolation. Its ratio is not below the
    square of that of the slowest mode around the attractor, because the covariance of a density relaxes twice as fast
    as its mean; it is above where a density takes longer to arrive than to relax.
    """
    window = max(_WINDOW, math.ceil(0.5 * relaxation))
    if len(rates) < max(3 * window, crossed * relaxation) or not np.isfinite(rates[-3 * window :]).all():
        return math.inf
    means = np.mean(np.reshape(rates[-3 * window :], (3, window)), axis=1)
    before, now = np.abs(np.diff(means)).tolist()
    if max(before, now) <= _STILL:
        return float(now)
    ratio = max(now / before, math.exp(-2 * window / relaxation)) if before > 0 else 1.0
    return float(now * ratio / (1 - ratio)) if ratio < 1 else math.inf


def spread_of(rates: list[float], change: float) -> float:
    """Return an error of the last of some ln rates: the change that is left, and half of how far they still vary."""
    last = np.array(rates[-2 * _WINDOW :])
    varies = 0.5 * float(np.ptp(last)) if np.isfinite(last).all() else math.inf
    return (change if math.isfinite(change) else 2.0 * varies) + varies
