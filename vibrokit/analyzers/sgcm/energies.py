"""Activation energies from rates at several intensities."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def extrapolated(
    intensities: Sequence[float], log_times: Sequence[float], errors: Sequence[float]
) -> tuple[float, float]:
    """Return the limit of D ln τ as D → 0, and its error estimate.

    D ln τ = ΔU + c D + d D² + …, where c is the logarithm of the prefactor. The three least intensities determine all
    three terms; the error estimate is what the last one changes. Two determine ΔU and c, and half of c D counts as
    error. With one, c is not known: the estimate is D ln τ with τ in section intervals, and 3 D counts as error.

    Parameters
    ----------
    intensities : sequence of float
        D, in descending order.
    log_times : sequence of float
        ln τ of each.
    errors : sequence of float
        Error estimates of ln τ.
    """
    d, y = np.array(intensities), np.array(intensities) * np.array(log_times)
    propagated = float(np.max(d * np.array(errors)))
    if len(d) == 1:
        return float(y[0]), 3.0 * float(d[0]) + propagated
    straight = np.polynomial.polynomial.polyfit(d[-2:], y[-2:], 1)
    amplified = propagated * (d[-2] + d[-1]) / (d[-2] - d[-1])
    if len(d) == 2:
        return float(straight[0]), float(abs(straight[1]) * d[-1] * 0.5 + amplified)
    curved = np.polynomial.polynomial.polyfit(d[-3:], y[-3:], 2)
    return float(curved[0]), float(abs(curved[0] - straight[0]) + amplified)
