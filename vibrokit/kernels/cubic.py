"""The cubic through two points with given slopes: where a step crosses a stop, and its largest value."""

import numpy as np
from numba import njit


@njit(nogil=True, cache=True, error_model="numpy")
def crossing(d0: float, r0: float, d1: float, r1: float, h: float) -> float:
    """Return where in (0, h) the cubic with end values d0 and d1, of opposite sign, and slopes r0 and r1 is zero."""
    b, c, d = h * r0, 3.0 * (d1 - d0) - h * (2.0 * r0 + r1), 2.0 * (d0 - d1) + h * (r0 + r1)
    low, high, s = 0.0, 1.0, d0 / (d0 - d1)
    for _ in range(60):
        value = d0 + s * (b + s * (c + s * d))
        if (value > 0.0) == (d1 > 0.0):
            high = s
        else:
            low = s
        new = s - value / (b + s * (2.0 * c + s * 3.0 * d))
        if not low < new < high:
            new = 0.5 * (low + high)
        if abs(new - s) < 1e-9:
            break
        s = new
    return s * h


@njit(nogil=True, cache=True, error_model="numpy")
def summit(d0: float, r0: float, d1: float, r1: float, h: float) -> float:
    """Return the largest value over (0, h) of the cubic that begins with the slope r0 > 0 and ends with r1 < 0."""
    b, c, d = h * r0, 3.0 * (d1 - d0) - h * (2.0 * r0 + r1), 2.0 * (d0 - d1) + h * (r0 + r1)
    # The zero of b + 2 c s + 3 d s² at which the slope falls, in the form that does not cancel.
    root = np.sqrt(max(c * c - 3.0 * d * b, 0.0))
    s = (-c - root) / (3.0 * d) if c > 0.0 else b / (root - c)
    return d0 + s * (b + s * (c + s * d))
