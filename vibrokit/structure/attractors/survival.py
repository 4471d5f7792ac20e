"""How long motion lasts that does not settle: many starts are watched for long."""

from __future__ import annotations

import concurrent.futures
import dataclasses
import math

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from vibrokit.kernels.ensemble import Ensemble, run_ensemble
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.stopping import COMPLETED, REACHED
from vibrokit.oscillator import Oscillator
from vibrokit.results.basins import LEFT, UNSETTLED
from vibrokit.results.survival import Survival
from vibrokit.structure.basins.arrival import arrival_at
from vibrokit.symbolic.flow_kind import Flow

_SIGNIFICANT = 3.0  # standard errors
_TAILS = (0.0, 0.25, 0.5, 0.75, 0.875)  # shares of the settled starts that are left out of the fit, from the first on
_LEAST_TAIL = 8
_LONG = 10  # times the time watched: no decay to speak of
_MISFIT = 1.1  # Lilliefors' 5% limit of √n times the distance between an exponential and its fit

Array = NDArray[np.float64]


def follow(
    osc: Oscillator,
    states: Array,
    orbits: list[Array],
    *,
    tolerance: float,
    periods: int,
    stepper: Stepper,
    executor: concurrent.futures.Executor | None = None,
) -> tuple[Ensemble, NDArray[np.int64]]:
    """Follow starts until they come to a known orbit, or for some periods.

    Parameters are those of `watch`.

    Returns
    -------
    ended : Ensemble
    labels : int64 array (count,)
        Index of the orbit that each start came to; UNSETTLED for those that go on, LEFT for numbers out of range.
    """
    stop = arrival_at(dict(enumerate(orbits)), tolerance)
    ended = run_ensemble(osc, Flow.STATE, stepper, states, periods, stop=stop, executor=executor)
    return ended, np.where(ended.status == REACHED, ended.label, np.where(ended.status == COMPLETED, UNSETTLED, LEFT))


def watch(
    osc: Oscillator,
    states: Array,
    orbits: list[Array],
    *,
    tolerance: float,
    periods: int,
    stepper: Stepper,
    executor: concurrent.futures.Executor | None = None,
) -> tuple[Survival, Array, NDArray[np.int64]]:
    """Follow starts until they come to a known orbit, or for a long time, and say how long they live.

    Parameters
    ----------
    osc : Oscillator
    states : array (count, n)
        Starts on the section.
    orbits : list of array (period, n)
        Points of the known orbits on the section; may be empty.
    tolerance : float
        Distance in (x, v) at which an orbit counts as reached.
    periods : int
        How long each start is followed, at most.
    stepper : Stepper
    executor : concurrent.futures.Executor, optional

    Returns
    -------
    survival : Survival
        Its lifetime is that of `fit_decay`. A start whose numbers ran out of range counts as settled then: it lives no
        longer.
    survivors : array (survivors, n)
        Last states of those that came to no orbit.
    labels : int64 array (count,)
        Index of the orbit that each start came to; UNSETTLED for the survivors, LEFT for numbers out of range.
    """
    ended, labels = follow(
        osc, states, orbits, tolerance=tolerance, periods=periods, stepper=stepper, executor=executor
    )
    alive = labels == UNSETTLED
    settled_after = np.where(alive, -1, ended.intervals)
    decay = fit_decay(settled_after, periods)
    survival = Survival(
        stepper=str(stepper),
        starts=len(labels),
        periods=periods,
        survivors=int(alive.sum()),
        lifetime=decay.lifetime,
        lifetime_error=decay.error,
        settled_after=settled_after,
    )
    return survival, ended.states[alive], labels


@dataclasses.dataclass(frozen=True)
class Decay:
    """How starts that had settled on nothing go over to orbits.

    Attributes
    ----------
    lifetime : float
        Mean time until one settles, of those that do (periods); infinite where none did.
    error : float
        Its standard error; infinite where none settled.
    lasting : bool
        Whether survivors are more than the tail of this decay: a share that never settles is likelier than none by
        three standard errors (log-likelihoods 4.5 apart), or the lifetime is beyond ten times the time watched.
    """

    lifetime: float
    error: float
    lasting: bool


def fit_decay(settled_after: NDArray[np.int64], periods: int) -> Decay:
    """Fit an exponential decay to when starts settled, by maximum likelihood.

    Survivors are the tail of the decay, their times censored, and a share, 0 or more, that never settles because it is
    on an attractor that is not known yet; the lifetime is that of the others (a cure model: Maller & Zhou, *Survival
    Analysis with Long-Term Survivors*). Starts that merely converge slowly settle first, and no earlier than they can:
    as many of the first quarter, half, … are left out as it takes for the rest to be exponential, by the distance of
    Kolmogorov and Smirnov.

    Parameters
    ----------
    settled_after : int array (starts,)
        When each settled (periods); −1 where it did not.
    periods : int
        How long each was followed, at most.

    Returns
    -------
    Decay
    """
    times = np.sort(settled_after[settled_after >= 0]).astype(float)
    survivors = len(settled_after) - len(times)
    fitted = Decay(math.inf, math.inf, survivors > 0)
    for share in _TAILS:
        after = float(np.quantile(times, share)) if share and len(times) else 0.0
        tail, window = times[times > after] - 0.5 - after, periods - after  # in the middle of the period it ended in
        if not len(tail) or (share and len(tail) < _LEAST_TAIL):
            break
        fitted = _fit_tail(tail, survivors, window, periods)
        spent = np.expm1(-tail / fitted.lifetime) / np.expm1(-window / fitted.lifetime)
        if np.abs(spent - (np.arange(len(tail)) + 0.5) / len(tail)).max() * math.sqrt(len(tail)) < _MISFIT:
            break
    return fitted


def _fit_tail(times: Array, survivors: int, window: float, periods: int) -> Decay:
    settled, mean = len(times), float(times.mean())
    lifetime = (settled * mean + survivors * window) / settled
    decay = Decay(lifetime, lifetime / math.sqrt(settled), survivors > 0 and lifetime > _LONG * periods)
    # Among those that settle in the window the times are exponential, cut off at its end; with u = window/lifetime
    # their mean is window·(1/u − 1/(eᵘ − 1)), and those of uniform times would be half of it.
    if not survivors or mean > 0.499 * window:
        return decay
    ratio = mean / window
    u = brentq(lambda u: 1 / u - math.exp(-u) / -math.expm1(-u) - ratio, 1e-3, 2 / ratio)
    seen = -math.expm1(-u)  # of the starts that settle at all, the share that does in the window
    total = settled + survivors
    if settled / total >= seen:
        return decay
    alone = -settled * (math.log(lifetime) + 1)
    mixed = settled * math.log(settled / total / seen * u / window) - settled * ratio * u
    mixed += survivors * math.log(survivors / total)
    lasting = decay.lasting or mixed - alone > 0.5 * _SIGNIFICANT**2
    known = 1 - u * u * math.exp(-u) / seen**2  # information on the lifetime, relative to that of times not cut off
    return Decay(window / u, window / u / math.sqrt(settled * known), lasting)
