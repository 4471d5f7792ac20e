"""How fast neighbours part: the largest Lyapunov exponent, with its standard error.

A positive one says that neighbours part; it cannot say whether the motion lasts, for a chaotic transient has one too.
"""

from __future__ import annotations

import concurrent.futures
import dataclasses
import math

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import StructureError
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.structure.linear_map import linear_map

_BLOCKS = 20  # of time, for the standard error
_SIGNIFICANT = 3.0  # standard errors

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True)
class LyapunovEstimate:
    """Largest Lyapunov exponent, measured over a finite time.

    Attributes
    ----------
    value : float
        Rate at which neighbours part, on average (s⁻¹).
    error : float
        Its standard error.
    periods : int
        Sections over which it was measured.
    interval : float
        Time from section to section (s).
    """

    value: float
    error: float
    periods: int
    interval: float

    @property
    def resolution(self) -> float:
        """Largest exponent (s⁻¹) that motion without chaos can show in this time.

        On an invariant circle neighbours part in proportion to the time, so that log(periods) is all the growth that
        there is.
        """
        return math.log1p(self.periods) / (self.periods * self.interval)


def lyapunov_exponent(
    osc: Oscillator,
    states: Array,
    stepper: Stepper,
    *,
    periods: int = 1000,
    skipped: int = 100,
    executor: concurrent.futures.Executor | None = None,
) -> LyapunovEstimate:
    """Measure the largest Lyapunov exponent along trajectories from many starts.

    A tangent vector is carried along each by the variational equations and brought back to length 1 at every section
    (Benettin, Galgani, Giorgilli & Strelcyn, *Meccanica* 15, 1980). All starts should be on one attractor: the value
    is the mean over all of them. Those whose numbers run out of range are left out.

    Parameters
    ----------
    osc : Oscillator
    states : array (count, n)
    stepper : Stepper
    periods : int
        Sections to measure over.
    skipped : int
        Sections before that, in which the tangent vectors find their direction.
    executor : concurrent.futures.Executor, optional

    Returns
    -------
    LyapunovEstimate

    Raises
    ------
    StructureError
        No start, no time to measure in, or no trajectory that stays finite.
    """
    if periods < 1 or skipped < 0 or not len(states):
        raise StructureError(
            f"a Lyapunov exponent was asked of {len(states)} starts over {periods} periods after {skipped}; give one "
            "start or more, periods of 1 or more, and none or more to skip."
        )
    here = np.array(states, dtype=float)
    count, size = here.shape
    # Directions that differ from start to start, so that even starts close together are not one measurement.
    tangents = np.random.default_rng(0).normal(size=(count, size))
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    growth = np.zeros((periods, count))
    finite = np.ones(count, dtype=bool)
    for period in range(skipped + periods):
        moved = linear_map(osc, here[finite], stepper, executor=executor)
        here[finite] = moved.images
        tangents[finite] = np.einsum("kij,kj->ki", moved.derivatives, tangents[finite])
        lengths = np.linalg.norm(tangents, axis=1)
        finite &= (lengths > 0) & np.isfinite(lengths)
        if not finite.any():
            raise StructureError(
                f"all {count} trajectories ran out of range within {period + 1} periods, so there is no Lyapunov "
                f"exponent; start on an attractor, or take a finer stepper than {stepper}."
            )
        lengths[~finite] = 1.0
        tangents /= lengths[:, None]
        if period >= skipped:
            growth[period - skipped] = np.log(lengths)
    rates = growth[:, finite] / osc.section_interval
    return LyapunovEstimate(float(rates.mean()), standard_error(rates), periods, osc.section_interval)


def standard_error(rates: Array) -> float:
    """Return the standard error of the mean of rates that are correlated in time, or from start to start.

    The scatter of the starts' means is honest about correlation in time, that of the means of long blocks of time
    about correlation between starts (batch means; Asmussen & Glynn, *Stochastic Simulation*, IV.5). The larger counts.

    Parameters
    ----------
    rates : array (periods, starts)

    Returns
    -------
    float
        Infinite for a single number.
    """
    blocks = [block.mean() for block in np.array_split(rates, min(_BLOCKS, len(rates)))]
    scatters = [
        np.std(means, ddof=1) / math.sqrt(len(means)) for means in (blocks, rates.mean(axis=0)) if len(means) > 1
    ]
    return float(max(scatters, default=math.inf))


def kind_of(estimate: LyapunovEstimate) -> str | None:
    """Say which kind of lasting motion a Lyapunov exponent is of.

    Chaotic if the exponent is above three standard errors and above what motion without chaos can show in the time.
    Not an attractor that never repeats if it is below minus three standard errors and neighbours have come closer by
    e or more in that time: the motion is then still settling on an orbit. Quasiperiodic in between: the exponent is 0
    as far as can be told, and weak chaos needs more periods to be told from it.

    Returns
    -------
    str or None
        ``"chaotic"``, ``"quasiperiodic"``, or None for motion that is still settling.
    """
    noise = _SIGNIFICANT * estimate.error
    if estimate.value > max(noise, estimate.resolution):
        return "chaotic"
    if estimate.value < -max(noise, 1.0 / (estimate.periods * estimate.interval)):
        return None
    return "quasiperiodic"
