"""Committors: the probability to reach one exit before the own core, by the backward equation, and the rate it gives.

On its way up to the edge of the basin a density is smooth; beyond, it falls into thin arms, in which interpolation
loses or adds some of it. A committor is 1 beyond the edge. So a rate follows from the density only inside the core, and
from the committor. On a tube between stiff stops (ω_n 250.7 s⁻¹, ζ 0.008, D = 4e-4, 280² nodes) what arrives in the
other cores is too little by 0.35 in ln, and the rate by the committor by 0.02.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.sgcm.cores import CoreSets
from vibrokit.analyzers.sgcm.density_flow import ABSORBED
from vibrokit.analyzers.sgcm.quasi_stationary import (
    Backward,
    QuasiStationary,
    most_intervals,
    remaining,
    spread_of,
)
from vibrokit.progress import advance, stage

_BELOW = 20.0  # in ln c: the floor lies that far below the rate

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


def committor(
    earlier: Backward,
    density: QuasiStationary,
    cores: CoreSets,
    target: int,
    relaxation: float,
    converged: float,
    start: Array | None = None,
) -> Committor:
    """Iterate the backward equation until the rate stays the same.

    The rate is the probability of the own core in the quasi-stationary density times the committor one section interval
    later: each exit begins with a last visit to the core (transition-path theory; E & Vanden-Eijnden, Annu. Rev. Phys.
    Chem. 61, 391, 2010).

    Parameters
    ----------
    earlier : Backward
    density : QuasiStationary
    cores : CoreSets
        Those of others absorb on the section, and at the outlet motion ends at any time.
    target : int
    relaxation : float
        Section intervals in which deviations of the density fall by a factor e.
    converged : float
        Change of ln rate that may be left.
    start : array (nx, nv), optional
        ln c, for example of stronger noise.
    """
    floor, at_exit = density.log_rates[target] - _BELOW, 0.0 if target == cores.outlet else -math.inf
    own = cores.own
    reached = cores.others.get(target, np.zeros_like(own))
    elsewhere = sum((covered for label, covered in cores.others.items() if label != target), own)
    with np.errstate(divide="ignore"):
        reached_log, stays = np.log(reached), np.log(1 - ABSORBED * np.minimum(elsewhere + reached, 1.0))
    found = np.maximum(reached_log if start is None else start, floor)
    rates, change = list[float](), np.inf
    most = most_intervals(relaxation)
    with stage("committor", unit="section intervals"):
        while len(rates) < most and change > converged:
            later = np.minimum(earlier(found, floor, at_exit), 0.0)
            rate = float(np.logaddexp.reduce((density.in_core + later)[own > 0]))
            rates.append(rate if rate > floor + 0.5 * _BELOW else -math.inf)
            found = np.clip(np.logaddexp(reached_log, later + stays), floor, 0.0)
            change = remaining(rates, relaxation)
            advance()
    return Committor(found, rates[-1], spread_of(rates, change), change <= converged)
