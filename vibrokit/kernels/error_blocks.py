"""Blocks of components of a flow that share one scale in error estimates."""

import numpy as np
from numpy.typing import NDArray


def error_blocks(states: int, momenta: int, equations: int) -> NDArray[np.int64]:
    """Return the block of each component of a flow with n states, n or no momenta, and their derivatives.

    Each state has its own scale. Momenta share one, the action has its own, and so does each block of derivatives:
    final states by initial states, final states by initial momenta, and so on. Momenta may be 1e-12 where states are
    1, and their error must be small relative to them. The same holds for each entry of a covariance, because the
    entries grow with different powers of a short time. There are n, n + n² or n + n(n + 1)/2 equations without momenta,
    2n + 1 or 2n + 1 + (2n)² with them.
    """
    state = list(range(states))
    if momenta == 0 and equations == states + states**2:
        return np.array(state + [states] * states**2)
    if momenta == 0:
        return np.arange(equations)
    phase = [*state, *[states] * states]
    matrix = [
        states + 2 + 2 * (row >= states) + (column >= states)
        for row in range(2 * states)
        for column in range(2 * states)
    ]
    return np.array([*phase, states + 1, *matrix][:equations])
