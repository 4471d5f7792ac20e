"""Motion that does not settle: how long it lasts, its Lyapunov exponent, and which samples are of one attractor.

A positive exponent shows that neighbours separate, but not that the motion lasts: a chaotic transient has one too.
"""

from __future__ import annotations

import concurrent.futures
import dataclasses
import math

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.spatial import cKDTree

from vibrokit.errors import StructureError
from vibrokit.kernels.ensemble import Stop
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.stopping import COMPLETED, LEFT_BASIN, REACHED, STALLED
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Survival
from vibrokit.results.basins import ESCAPED, NOT_FOLLOWED, UNSETTLED
from vibrokit.structure.along_x import wrapped
from vibrokit.structure.basins.landings import followed
from vibrokit.structure.linear_map import linear_map

Array = NDArray[np.float64]


def follow(
    osc: Oscillator,
    states: Array,
    stop: Stop,
    periods: int,
    stepper: Stepper,
    executor: concurrent.futures.Executor | None = None,
) -> tuple[Array, NDArray[np.int64], NDArray[np.int64]]:
    """Follow starts (count, n) on the section until they arrive at a known orbit, or for some periods.

    Returned are where they end, after how many periods, and the labels of the arrival test; UNSETTLED where no orbit
    was reached, ESCAPED where the motion diverged, NOT_FOLLOWED where it needs too many steps. Where x repeats, motion
    is moved back by whole turns.
    """
    here, alive = np.array(wrapped(osc, states), dtype=float), np.arange(len(states))
    intervals, labels = np.zeros(len(states), dtype=np.int64), np.full(len(states), UNSETTLED, dtype=np.int64)
    while alive.size:
        ended, _ = followed(osc, stepper, here[alive], periods - intervals[alive], stop, executor=executor)
        here[alive], intervals[alive] = ended.states, intervals[alive] + ended.intervals
        how = [np.isin(ended.status, (REACHED, LEFT_BASIN)), ended.status == COMPLETED, ended.status == STALLED]
        ends = np.select(how, [ended.label, UNSETTLED, NOT_FOLLOWED], ESCAPED)
        labels[alive] = ends
        alive = alive[(ends == UNSETTLED) & (intervals[alive] < periods)]
    return here, intervals, labels


def watch(
    osc: Oscillator,
    states: Array,
    stop: Stop,
    stepper: Stepper,
    *,
    longest: int = 20_000,
    exposure: int = 200_000,
    executor: concurrent.futures.Executor | None = None,
) -> tuple[Survival, Array]:
    """Follow starts (count, n) until it is known how long they survive; return that, and the survivors' last states.

    The watch ends when all have arrived at a known orbit or diverged, after `longest` periods, or when the survivors
    together have gone on for `exposure` periods since the last one settled: transients with a mean lifetime below a
    third of that would have settled once in that time with a probability of 95 %. Starts that need too many steps on
    the way are left out.
    """
    here, settled_after = np.array(states, dtype=float), np.full(len(states), -1, dtype=np.int64)
    alive, periods, stalled = np.arange(len(states)), 0, np.empty(0, dtype=np.int64)
    while alive.size:
        quiet = periods - max(0, int(settled_after.max()))
        stretch = min(longest - periods, math.ceil(exposure / alive.size) - quiet)
        if stretch <= 0:
            break
        here[alive], intervals, labels = follow(osc, here[alive], stop, stretch, stepper, executor)
        settled_after[alive] = np.where(labels == UNSETTLED, -1, periods + intervals)
        stalled = np.append(stalled, alive[labels == NOT_FOLLOWED])
        alive, periods = alive[labels == UNSETTLED], periods + stretch
    settled_after = np.delete(settled_after, stalled)
    lifetime, error = fit_decay(settled_after, periods)
    survival = Survival(
        stepper=str(stepper),
        starts=len(settled_after),
        periods=periods,
        survivors=len(alive),
        lifetime=lifetime,
        lifetime_error=error,
        settled_after=settled_after,
    )
    return survival, here[alive]


def fit_decay(settled_after: NDArray[np.int64], periods: int) -> tuple[float, float]:
    """Fit an exponential decay to the periods after which starts settled (−1: not within `periods`).

    Returns the mean lifetime of those that do settle (periods) and its standard error, both infinite where none did.
    The fit is by maximum likelihood. Survivors are the tail of the decay, their times censored, and a fraction, 0 or
    more, that never settles because it is on an attractor that is not known yet (a cure model: Maller & Zhou, *Survival
    Analysis with Long-Term Survivors*). Starts that merely converge slowly settle first, and no earlier than they can:
    as many of the first quarter, half, … are left out as it takes for the rest to be exponential, by the
    Kolmogorov–Smirnov distance.
    """
    times = np.sort(settled_after[settled_after >= 0]).astype(float)
    survivors = len(settled_after) - len(times)
    lifetime = error = math.inf
    for fraction in (0.0, 0.25, 0.5, 0.75, 0.875):
        after = float(np.quantile(times, fraction)) if fraction and len(times) else 0.0
        tail, window = times[times > after] - 0.5 - after, periods - after  # in the middle of the period it ended in
        if not len(tail) or (fraction and len(tail) < 8):
            break
        lifetime, error = _fit_tail(tail, survivors, window)
        spent = np.expm1(-tail / lifetime) / np.expm1(-window / lifetime)
        distance = float(np.abs(spent - (np.arange(len(tail)) + 0.5) / len(tail)).max())
        if distance * math.sqrt(len(tail)) < 1.1:  # Lilliefors' limit, at 5 %, for an exponential and its fit
            break
    return lifetime, error


def _fit_tail(times: Array, survivors: int, window: float) -> tuple[float, float]:
    """Fit the lifetime of starts that settled within a window after some times, and its standard error."""
    settled, mean = len(times), float(times.mean())
    lifetime = (settled * mean + survivors * window) / settled
    # Among those that settle in the window the times are exponential, cut off at its end; with u = window/lifetime
    # their mean is window·(1/u − 1/(eᵘ − 1)), and those of uniform times would be half of it.
    if survivors and mean <= 0.499 * window:
        ratio = mean / window
        u = brentq(lambda u: 1 / u - math.exp(-u) / -math.expm1(-u) - ratio, 1e-3, 2 / ratio)
        seen = -math.expm1(-u)  # fraction of the starts that settle at all which does so in the window
        if settled / (settled + survivors) < seen:
            known = 1 - u * u * math.exp(-u) / seen**2  # information, relative to that of times not cut off
            return window / u, window / u / math.sqrt(settled * known)
    return lifetime, lifetime / math.sqrt(settled)


@dataclasses.dataclass(frozen=True)
class LyapunovEstimate:
    """Largest Lyapunov exponent (s⁻¹) and its standard error, over some periods with an interval (s) each."""

    value: float
    error: float
    periods: int
    interval: float

    @property
    def resolution(self) -> float:
        """Largest exponent (s⁻¹) that motion without chaos can show in this time.

        On an invariant circle neighbours separate in proportion to the time, so the growth is log(periods).
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
    """Measure the largest Lyapunov exponent over some periods, along trajectories from many starts (count, n).

    The variational equations advance a tangent vector along each, which is scaled to length 1 at every section
    (Benettin, Galgani, Giorgilli & Strelcyn, *Meccanica* 15, 1980). In the `skipped` periods before the measurement the
    tangent vectors find their direction. All starts should be on one attractor: the value is the mean over all of them.
    Trajectories that diverge are left out; a StructureError is raised if all do.
    """
    if periods < 1 or skipped < 0 or not len(states):
        raise StructureError(
            f"a Lyapunov exponent was asked of {len(states)} starts over {periods} periods after {skipped}; give one "
            "start or more, periods of 1 or more, and none or more to skip."
        )
    here = np.array(states, dtype=float)
    count, size = here.shape
    # Directions that differ from start to start, so that starts close together are separate measurements.
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
    """Return the standard error of the mean of rates (periods, starts), correlated in time or between starts.

    The scatter of the starts' means includes correlation in time, that of the means of long blocks of time includes
    correlation between starts (batch means; Asmussen & Glynn, *Stochastic Simulation*, IV.5). The larger one is
    returned; it is infinite for a single number.
    """
    blocks = [block.mean() for block in np.array_split(rates, min(20, len(rates)))]
    scatters = [
        np.std(means, ddof=1) / math.sqrt(len(means)) for means in (blocks, rates.mean(axis=0)) if len(means) > 1
    ]
    return float(max(scatters, default=math.inf))


def kind_of(estimate: LyapunovEstimate) -> str | None:
    """Return the kind of lasting motion that a Lyapunov exponent shows; None for motion that is still settling.

    The motion is chaotic if the exponent is above three standard errors and above what motion without chaos can show in
    the time. It is still settling on an orbit if the exponent is below minus three standard errors and neighbours have
    come closer by e or more in that time. In between it is quasiperiodic: the exponent cannot be distinguished from 0,
    and weak chaos would need more periods to be detected.
    """
    noise = 3 * estimate.error
    if estimate.value > max(noise, estimate.resolution):
        return "chaotic"
    if estimate.value < -max(noise, 1.0 / (estimate.periods * estimate.interval)):
        return None
    return "quasiperiodic"


def separate(samples: list[Array], tolerance: float) -> list[NDArray[np.int64]]:
    """Group samples (count, n) of motion by attractor; return the indices of each group, the largest group first.

    Two samples overlap, and are of one attractor, if more than half the points of either are near the other: within the
    tolerance, a distance in (x, v), or within twice the median distance of neighbours in either sample, because the
    motion may be far larger than the region that the tolerance is for. Groups that both overlap with a sample are one.
    A sample has the points of one trajectory on the section.
    """
    groups: list[tuple[list[int], cKDTree, float]] = []
    for index, sample in enumerate(samples):
        places = np.asarray(sample, dtype=float)[:, :2]
        tree = cKDTree(places)
        spacing = float(np.median(tree.query(places, k=2)[0][:, 1]))
        met = [group for group in groups if _overlap(tree, group[1], max(tolerance, 2 * spacing, 2 * group[2]))]
        apart = [group for group in groups if not any(group is other for other in met)]
        members = [index, *(member for group in met for member in group[0])]
        together = cKDTree(np.concatenate([places, *(group[1].data for group in met)])) if met else tree
        groups = [*apart, (members, together, max([spacing, *(group[2] for group in met)]))]
    found = [np.array(sorted(members), dtype=np.int64) for members, _, _ in groups]
    return sorted(found, key=lambda members: (-len(members), int(members[0])))


def _overlap(one: cKDTree, other: cKDTree, tolerance: float) -> bool:
    near = (np.isfinite(a.query(b.data, distance_upper_bound=tolerance)[0]) for a, b in ((one, other), (other, one)))
    return any(float(np.mean(close)) > 0.5 for close in near)
