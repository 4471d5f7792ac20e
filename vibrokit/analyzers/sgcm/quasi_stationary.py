"""Quasi-stationary densities and committors, and the rates that they give, by iteration over section intervals.

What leaves is put back into the core of the attractor. So the density stays the same, and what leaves in a section
interval is the inverse of the mean exit time from the core, also where exits are no rare events. Where they are rare,
the density is that of states that have not left.

On its way up to the edge of the basin a density is smooth; beyond, it falls into thin arms, in which interpolation
loses or adds some of it. A committor is 1 beyond the edge. So a rate follows from the density only inside the core, and
from the committor. On a tube between stiff stops (ω_n 250.7 s⁻¹, ζ 0.008, D = 4e-4, 280² nodes) what arrives in the
other cores is too little by 0.35 in ln, and the rate by the committor by 0.02.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.sgcm.cores import CoreSets
from vibrokit.analyzers.sgcm.density_flow import ABSORBED, Leg
from vibrokit.analyzers.sgcm.density_grid import DensityGrid
from vibrokit.analyzers.sgcm.propagator import Propagator
from vibrokit.progress import advance, stage

_BELOW = 15.0  # in ln ρ: the floor lies that far below the density that leaves, so that it adds e⁻¹⁵ of it
_DEEPER = 20.0  # in ln c: the floor lies that far below the rate
_RELEVANT = 14.0  # in ln ρ below the density that leaves: paths through less of it add e⁻¹⁴ of the rate
_RAREST = 35.0  # in ln rate: exits that are rarer than the most frequent one by more are not resolved

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True)
class Convergence:
    """When the iteration of a rate over section intervals ends."""

    relaxation: float  # section intervals in which deviations of the density fall by a factor e
    tolerance: float  # change of ln rate that may be left
    crossed: float = 4.0  # relaxations in which what is missing arrives from the attractor: before, a rate may rest
    window: int = 4  # section intervals, at least: changes of means over windows give how fast changes fall
    still: float = 1e-3  # means of ln rate that differ by less are equal, as errors of rates are above 1e-2

    def goes_on(self, rates: list[float]) -> bool:
        """Whether more is left than tolerated; after 40 relaxations iteration is given up."""
        return len(rates) < int(np.clip(40 * self.relaxation, 60, 3000)) and not self.reached(rates)

    def reached(self, rates: list[float]) -> bool:
        """Whether so little is left as is tolerated."""
        return self.remaining(rates) <= self.tolerance

    def remaining(self, rates: list[float]) -> float:
        """Return the change of the last of some ln rates that further iteration would make.

        It is the sum of a geometric series of the means of three windows. In windows shorter than half of the
        relaxation, a rate may change little by chance. The ratio is at least the square of that of the slowest mode,
        because a covariance relaxes twice as fast as a mean.
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
    """The density of states that last came from the attractor; arrays have the shape (nx, nv)."""

    propagator: Propagator
    cores: CoreSets
    phi: Array  # ln ρ on the section; its probability is 1
    highest: Array  # largest ln ρ at each node over the last section interval
    log_rates: Mapping[int, float]  # by target: ln of the probability that leaves in one section interval
    in_core: Array  # ln of the probability that is in the own core, or has been put back there; −∞ elsewhere
    level: float  # ln ρ where most of it leaves
    change: float  # error of the largest rate's logarithm that iteration leaves
    converged: bool  # whether iteration has ended by itself
    drift: float  # relative change of the probability in one section interval by truncation errors
    intervals: int

    @property
    def grid(self) -> DensityGrid:
        """The nodes."""
        return self.propagator.grid

    @property
    def top(self) -> float:
        """ln ρ where most of it leaves, or at the maximum if that is less."""
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
    """Iterate from ln ρ at the start, an array (nx, nv), until the rates stay the same."""
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

    Returns ln of all probability, and by target ln of the share that left and ln ρ where it left.
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


@dataclasses.dataclass(frozen=True, eq=False)
class Committor:
    """The probability to reach one exit before the core of the own attractor, and the rate that follows."""

    log_values: Array  # (nx, nv): its ln, for a start at each node on the section; least where no density matters
    log_rate: float  # ln of the probability that leaves in one section interval for good
    change: float  # error of it that iteration leaves
    converged: bool  # whether iteration has ended by itself


def committors(
    density: QuasiStationary, convergence: Convergence, starts: Mapping[int, Array] | None = None
) -> dict[int, Committor]:
    """Return the committor of each target whose rate is known; `starts` are ln c, for example of stronger noise."""
    if not density.log_rates:
        return {}
    legs, begun = relevant_legs(density), starts or {}
    return {target: _committor(density, legs, target, convergence, begun.get(target)) for target in density.log_rates}


def relevant_legs(density: QuasiStationary) -> list[Leg]:
    """Return the backward legs where the density, at its time, is large enough to matter, and in the cores."""
    cores = density.cores
    return density.propagator.backward_legs(density.phi, density.level - _RELEVANT, (cores.own, *cores.others.values()))


def _committor(
    density: QuasiStationary, legs: Sequence[Leg], target: int, convergence: Convergence, start: Array | None
) -> Committor:
    """Iterate the backward equation until the rate stays the same.

    The rate is the probability of the own core in the quasi-stationary density times the committor one section interval
    later: each exit begins with a last visit to the core (transition-path theory; E & Vanden-Eijnden, Annu. Rev. Phys.
    Chem. 61, 391, 2010).
    """
    cores, floor = density.cores, density.log_rates[target] - _DEEPER
    at_exit = 0.0 if target == cores.outlet else -math.inf
    reached = cores.others.get(target, np.zeros_like(cores.own))
    elsewhere = sum((covered for label, covered in cores.others.items() if label != target), cores.own)
    with np.errstate(divide="ignore"):
        reached_log, stays = np.log(reached), np.log(1 - ABSORBED * np.minimum(elsewhere + reached, 1.0))
    found, rates = np.maximum(reached_log if start is None else start, floor), list[float]()
    with stage("committor", unit="section intervals"):
        while convergence.goes_on(rates):
            *_, earlier = density.propagator.earlier(legs, found, floor, at_exit)
            later = np.minimum(earlier, 0.0)
            rate = float(np.logaddexp.reduce((density.in_core + later)[cores.own > 0]))
            rates.append(rate if rate > floor + 0.5 * _DEEPER else -math.inf)
            found = np.clip(np.logaddexp(reached_log, later + stays), floor, 0.0)
            advance()
    return Committor(found, rates[-1], convergence.error(rates), convergence.reached(rates))
