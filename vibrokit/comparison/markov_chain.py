"""Markov chains by ln of their rates: stationary probabilities, and how likely motion is lost on its way."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from vibrokit.errors import StructureError

Array = NDArray[np.float64]


def log_stationary(log_rates: Array, names: Sequence[str]) -> Array:
    """Return ln of the stationary probabilities of a Markov chain, from ln of its rates, shape (n, n).

    By elimination without subtractions (Grassmann, Taksar & Heyman, Oper. Res. 33, 1107, 1985), in logarithms: rates of
    1e-400 are as good as any. Raises StructureError if a state is never left.
    """
    rates = np.array(log_rates, dtype=float)
    np.fill_diagonal(rates, -np.inf)
    count = len(rates)
    left = np.full(count, -np.inf)
    for k in range(count - 1, 0, -1):
        left[k] = logsumexp(rates[k, :k])
        if not np.isfinite(left[k]):
            raise StructureError(f"no exit from {names[k]} was resolved, so that its probability is not known.")
        through = rates[:k, k, None] + rates[None, k, :k] - left[k]
        rates[:k, :k] = np.logaddexp(rates[:k, :k], through)
    found = np.zeros(count)
    for k in range(1, count):
        found[k] = logsumexp(found[:k] + rates[:k, k]) - left[k]
    stationary: Array = found - logsumexp(found)
    return stationary


def log_loss(log_rates: Array, start: int, end: int) -> float:
    """Return ln of the probability that motion from one state is lost before it reaches another one.

    `log_rates`, shape (n, n + 1), has the rates from row to column; in the last column those of being lost. All other
    states are eliminated, as in `log_stationary`; those that are never left are not passed through.
    """
    rates = np.array(log_rates, dtype=float)
    np.fill_diagonal(rates, -np.inf)
    for k in range(len(rates)):
        left = logsumexp(rates[k])
        if k not in (start, end) and np.isfinite(left):
            rates = np.logaddexp(rates, rates[:, k, None] + rates[None, k] - left)
            np.fill_diagonal(rates, -np.inf)
            rates[:, k] = -np.inf
    lost, reached = rates[start, -1], rates[start, end]
    return float(lost - np.logaddexp(lost, reached)) if np.isfinite(lost) else -np.inf
