"""Activation energies from rates at several intensities."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def extrapolated(
    intensities: Sequence[float], log_times: Sequence[float], errors: Sequence[float]
) -> tuple[float, float]:
    """Return the limit of D ln τ as D → 0, and its error estimate.

    D ln τ = ΔU + c D + d D² + …, where c is the logarithm of the prefactor. The value is that of the straight line
    through the two least intensities. Its error estimate is twice what a third intensity changes by the term of second
    order, since terms of higher order are not known, and the errors of ln τ. With two intensities, d is not
    known: c D counts in place of the former, and D₁ D₂/ΔU, which is what the first correction of Kramers' formula to a
    prefactor is like. With one, c is not known: the value is D ln τ with τ in section intervals, and 3 D counts as
    error.

    Parameters
    ----------
    intensities : sequence of float
        D, in descending order.
    log_times : sequence of float
        ln τ of each.
    errors : sequence of float
        Error estimates of ln τ.
    """
    d = np.array(intensities)
    y, e = d * np.array(log_times), d * np.array(errors)
    if len(d) == 1:
        return float(y[0]), 3.0 * float(d[0]) + float(e[0])
    slope = (y[-2] - y[-1]) / (d[-2] - d[-1])
    straight = y[-1] - slope * d[-1]
    propagated = float(np.hypot(e[-1] * d[-2], e[-2] * d[-1]) / (d[-2] - d[-1]))
    if len(d) == 2:
        return float(straight), float(abs(slope) * d[-1] + d[0] * d[1] / max(abs(straight), d[1])) + propagated
    curved = np.polynomial.polynomial.polyfit(d[-3:], y[-3:], 2)[0]
    return float(straight), 2.0 * float(abs(curved - straight)) + propagated
