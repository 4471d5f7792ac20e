"""Rates from exit times, with confidence intervals, and the test for an exponential law."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
from scipy import stats

from vibrokit.analyzers.mfet.direct import Exits

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
    """Return what is known of exits that none of a number of independent estimates of all exits has seen: a bound."""
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
