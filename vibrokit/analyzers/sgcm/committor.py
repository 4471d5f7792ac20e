"""Committors: the probability to reach one exit before the own core, by the backward equation, and the rate it gives.

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

from vibrokit.analyzers.sgcm.density_flow import ABSORBED, Leg
from vibrokit.analyzers.sgcm.quasi_stationary import Convergence, QuasiStationary
from vibrokit.progress import advance, stage

_BELOW = 20.0  # in ln c: the floor lies that far below the rate
_RELEVANT = 14.0  # in ln p below the density that leaves: paths through less of it add e⁻¹⁴ of the rate

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class Committor:
    """The probability to reach one exit before the core of the own attractor, and the rate that follows.

    Attributes
    ----------
    log_values : array (nx, nv)
        Its logarithm, for a start at each node on the section; at its least where the density is too small to matter.
    log_rate : float
        ln of the probability that leaves in one section interval for good.
    change : float
        Error of it that iteration leaves.
    converged : bool
        Whether iteration has ended by itself.
    """

    log_values: Array
    log_rate: float
    change: float
    converged: bool


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
    cores, floor = density.cores, density.log_rates[target] - _BELOW
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
            rates.append(rate if rate > floor + 0.5 * _BELOW else -math.inf)
            found = np.clip(np.logaddexp(reached_log, later + stays), floor, 0.0)
            advance()
    return Committor(found, rates[-1], convergence.error(rates), convergence.reached(rates))
