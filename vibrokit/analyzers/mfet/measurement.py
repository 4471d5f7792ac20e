"""What simulations of exits at one noise intensity say: rates, their intervals, the law of exits, and the limits."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping

import numpy as np
from scipy import stats

from vibrokit.analyzers.exits import LeaveBasin
from vibrokit.analyzers.metastability import targets_at
from vibrokit.analyzers.mfet.direct import DirectRun, Escapes, Exits
from vibrokit.analyzers.mfet.splitting import SplittingRun
from vibrokit.analyzers.mfet.walk import Walk
from vibrokit.kernels.stopping import COMPLETED
from vibrokit.results.basins import ESCAPED
from vibrokit.results.codes import Code
from vibrokit.results.finding import Finding
from vibrokit.results.rated import METASTABLE

CONFIDENCE = 0.95
"""Of all intervals."""

_FEWEST = 20  # exits for which the law is tested


@dataclasses.dataclass(frozen=True)
class RateEstimate:
    """ln of the number of exits in an interval between tests, its standard error, and its confidence interval."""

    log_value: float
    log_error: float
    log_lower: float
    log_upper: float


def mean_tests(exits: Exits) -> float:
    """Return the mean number of tests until an exit, from walkers that have left and others that have not.

    Up to the last exit it is that of all walkers; after it, those that are left go on leaving at the rate of the later
    half of the exits. So a time that all need before they can leave does no harm, and if exit times are exponential,
    this is as exact as the maximum-likelihood estimate, the time of all walkers over the number of exits.
    """
    count = len(exits)
    walkers = count + exits.censored
    if count < _FEWEST or not exits.censored:
        return exits.at_risk / count
    middle = exits.tests[count // 2 - 1]
    later = np.maximum(exits.tests - middle, 0)
    after = later.sum() + exits.censored * later[-1]
    rate = int((later > 0).sum()) / float(after) if after > 0 else count / exits.at_risk
    return exits.at_risk / walkers + exits.censored / walkers / rate


def rate_of(exits: Exits, count: int) -> RateEstimate:
    """Return the rate of those exits that lead to one of the targets; the interval is that of a Poisson number.

    With no exit at all, the estimate is −∞ and the upper end a bound.
    """
    if count == 0:
        return rate_unseen(0.0, exits.at_risk)
    tail = (1.0 - CONFIDENCE) / 2.0
    value = math.log(count / len(exits) / mean_tests(exits))
    lower = stats.chi2.ppf(tail, 2 * count) / 2.0 / count
    upper = stats.chi2.ppf(1.0 - tail, 2 * count + 2) / 2.0 / count
    return RateEstimate(value, count**-0.5, value + math.log(lower), value + math.log(upper))


def rate_around(log_value: float, relative_error: float, count: int) -> RateEstimate:
    """Return the estimate that is the mean of a number of independent ones, with Student's interval for its ln."""
    factor = float(stats.t.ppf(0.5 + CONFIDENCE / 2.0, count - 1))
    spread = math.log1p(factor * relative_error)
    return RateEstimate(log_value, relative_error, log_value - spread, log_value + spread)


def rate_unseen(log_total: float, count: int) -> RateEstimate:
    """Return the upper bound of a rate to a target that none of `count` independent estimates of all exits has seen."""
    return RateEstimate(-math.inf, math.inf, -math.inf, log_total + math.log(-math.log1p(-CONFIDENCE) / count))


def exponential_p_value(exits: Exits, seed: int) -> float:
    """Return the probability of exit times that deviate more from an exponential law, whatever its mean.

    The total times on test at the exits, over that at the last one, are those of independent uniform numbers in order
    (Epstein & Sobel, J. Am. Stat. Assoc. 48, 486, 1953), also if other walkers have not left. Kolmogorov's test
    compares them. The first tenth of the exits does not count, since no walker can leave at once. A time is known to
    one interval between tests, in which it is drawn. NaN with fewer than 20 exits.
    """
    count = len(exits)
    if count < _FEWEST:
        return math.nan
    times = np.sort(exits.tests - np.random.default_rng(seed).random(count))
    remaining = count + exits.censored - np.arange(count)
    on_test = np.cumsum((np.diff(times, prepend=0.0) * remaining)[count // 10 :])
    return float(stats.kstest(on_test[:-1] / on_test[-1], "uniform").pvalue)


@dataclasses.dataclass(frozen=True, eq=False)
class AtIntensity:
    """Rates and exits at one noise intensity, with the findings."""

    intensity: float
    method: str  # "direct" or "splitting"
    rates: Mapping[int, RateEstimate]  # by target; ln of rates in s⁻¹
    exits: Exits | None
    interval: float  # time between exit tests (s)
    p_value: float = math.nan  # of the test for an exponential law
    step_change: float = math.nan  # what half the steps change in ln of the rate of all exits
    step_change_error: float = math.nan
    escapes: Escapes | None = None
    metastable: bool = True  # whether the state outlasts its relaxation; otherwise the rate says nothing about ΔU
    findings: tuple[Finding, ...] = ()


def from_direct(run: DirectRun, coarser: DirectRun | None, escapes: int) -> AtIntensity:
    """Return what exits say; `coarser` has steps twice as long, and the last part of some walks is kept."""
    walk, exits, change = run.walk, run.exits(), (math.nan, math.nan)
    targets = {*np.unique(exits.targets).tolist(), *_awaited(walk)}
    rates = {t: _in_seconds(rate_of(exits, int((exits.targets == t).sum())), walk) for t in targets}
    p_value = exponential_p_value(exits, walk.key(12))
    if coarser is not None and len(exits) and coarser.left:
        other = coarser.exits()
        change = math.log(mean_tests(exits) / mean_tests(other)), math.hypot(len(exits) ** -0.5, len(other) ** -0.5)
    return AtIntensity(
        walk.intensity, "direct", rates, exits, walk.interval, p_value, *change,
        escapes=run.escapes(escapes) if escapes and run.left else None,
        metastable=not len(exits) or mean_tests(exits) >= METASTABLE * walk.relaxation * walk.checks,
        findings=tuple(_limits(walk, exits, p_value, *change)),
    )  # fmt: skip


def from_splitting(run: SplittingRun) -> AtIntensity:
    """Return the rates by splitting, as means over its batches."""
    walk, estimates = run.walk, run.estimates
    source, intensity, error = walk.problem.source, walk.intensity, estimates.error
    count, rates, found = len(estimates.log_values), dict[int, RateEstimate](), list[Finding]()
    for target, (share, spread) in estimates.shares().items():
        if share > 0:
            both = math.hypot(error, spread / share)
            rates[target] = rate_around(estimates.log_mean + math.log(share), both, count)
    for target in _awaited(walk) if rates else ():
        rates.setdefault(target, rate_unseen(estimates.log_mean, count))
    if not rates:
        found.append(Finding.of(Code.NO_EXCURSION_LEFT, source, intensity=intensity, replicas=count))
    elif error > run.wanted:
        found.append(
            Finding.of(
                Code.SPLITTING_NOT_CONVERGED, source,
                intensity=intensity, error=error, wanted=run.wanted, replicas=count,
            )
        )  # fmt: skip
    in_seconds = {target: _in_seconds(rate, walk, walk.checks) for target, rate in rates.items()}
    return AtIntensity(walk.intensity, "splitting", in_seconds, None, walk.interval, findings=tuple(found))


def _limits(walk: Walk, exits: Exits, p_value: float, change: float, change_error: float) -> Iterator[Finding]:
    """What limits the rates: few exits, another law than an exponential one, the steps, or the targets."""
    source, intensity = walk.problem.source, walk.intensity
    if not len(exits):
        # Nobody leaves at once: while its start is not forgotten a walker is no evidence.
        idle = walk.memory * walk.checks * exits.censored
        seen = dataclasses.replace(exits, at_risk=max(exits.at_risk - idle, 1))
        bound = math.exp(-_in_seconds(rate_of(seen, 0), walk).log_upper)
        yield Finding.of(Code.NO_EXIT_SEEN, source, intensity=intensity, time=bound)
        return
    if p_value < 1e-3:
        yield Finding.of(Code.NOT_EXPONENTIAL, source, intensity=intensity, p_value=p_value)
    if abs(change) > 3.0 * change_error:
        yield Finding.of(Code.STEPS_CHANGE_RATE, source, intensity=intensity, change=change, error=change_error)
    for target in np.unique(exits.targets).tolist():
        share = _kept(walk, target) if target >= 0 and not walk.problem.exit.by_position else 1.0
        if share < 0.5:
            yield Finding.of(Code.TARGET_NOT_METASTABLE, source, target, intensity=intensity, share=share)


def _awaited(walk: Walk) -> tuple[int, ...]:
    """Labels of the targets for which something is said even if no exit leads there: a bound."""
    if walk.problem.exit.by_position:
        return ()
    targets = [target.label for target in targets_at(walk.problem, walk.intensity)]
    return (*targets, ESCAPED) if np.isfinite(walk.problem.faces).any() else tuple(targets)


def _kept(walk: Walk, target: int) -> float:
    """Share of walkers that stay at a target until they have forgotten their start."""
    attractor = walk.problem.structure.attractors[target]
    other = dataclasses.replace(walk, problem=dataclasses.replace(walk.problem, attractor=attractor, exit=LeaveBasin()))
    ended = other.advance(other.from_orbit(200, 13), other.memory, other.arrival)
    return float((ended.status == COMPLETED).mean())


def _in_seconds(rate: RateEstimate, walk: Walk, tests: int = 1) -> RateEstimate:
    """The rate in s⁻¹ of one that is per so many intervals between tests."""
    shift = math.log(walk.interval * tests)
    return RateEstimate(rate.log_value - shift, rate.log_error, rate.log_lower - shift, rate.log_upper - shift)
