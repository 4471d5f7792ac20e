"""Activation energies from rates at several intensities."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vibrokit.results.arrhenius import ENOUGH

Array = NDArray[np.float64]


def limit_of(
    intensities: Sequence[float],
    log_times: Sequence[float],
    errors: Sequence[float],
    changes: Sequence[Sequence[float]] = (),
) -> tuple[float, float]:
    """Return the limit of D ln τ as D → 0, and its error estimate.

    The value is that of ln τ = ΔU/D + c through the two least intensities. How a prefactor depends on D is not known.
    So the error estimate is infinite with two intensities. With more it is the largest change by one of these, plus
    the change by the errors of ln τ:

    - a prefactor proportional to D or 1/D. Kramers' rate has 1/D at weak damping, and √D if the force is periodic and
      not weak (Lehmann, Reimann & Hänggi, Phys. Rev. Lett. 84, 1639, 2000);
    - a correction D/ΔU to the prefactor, as in the next order of Kramers' formula;
    - the power of D that the third intensity shows, and twice the correction of first order in D that it shows, since
      terms of higher order are not known.

    Parameters
    ----------
    intensities : sequence of float
        D, two at least, in descending order.
    log_times : sequence of float
        ln τ of each.
    errors : sequence of float
        Error estimates of ln τ that are independent.
    changes : sequence of sequence of float
        Changes of ln τ, with their signs, by what may be wrong at all intensities alike. Each adds what it changes of
        the limit, or of D ln τ at the least intensity, if that is more.
    """
    d, times = np.array(intensities), np.array(log_times)
    value = _limit(d[-2:], times[-2:])
    if len(d) < ENOUGH:
        return value, math.inf
    powers = -np.log(d)
    of_prefactor = [
        _limit(d[-2:], powers[-2:]),
        d[-2] * d[-1] / max(abs(value), d[-1]),
        _limit(d[-3:], times[-3:], powers[-3:]) - value,
        2.0 * (_limit(d[-3:], times[-3:], d[-3:]) - value),
    ]
    propagated = math.hypot(d[-1] * errors[-1] * d[-2], d[-2] * errors[-2] * d[-1]) / (d[-2] - d[-1])
    systematic = sum(max(abs(_limit(d[-2:], each[-2:])), abs(d[-1] * each[-1])) for each in np.array(changes))
    return value, float(np.max(np.abs(of_prefactor))) + propagated + float(systematic)


def _limit(d: Array, times: Array, *corrections: Array) -> float:
    """ΔU of ln τ = ΔU/D + c + further terms, as many as there are intensities."""
    terms = np.stack([1.0 / d, np.ones_like(d), *corrections], axis=1)
    return float(np.linalg.solve(terms, times)[0])
