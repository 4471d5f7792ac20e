"""Contacts too slow to determine the jump of the momenta."""

from numba import njit

from vibrokit.kernels.options import INNER
from vibrokit.kernels.templates.scene import STATES
from vibrokit.kernels.templates.settling import push_at
from vibrokit.kernels.templates.steps import EPSILON, is_clamped, jumps_at, stop

# --- scene above, stepper below ---

BLURRED = 10.0


@njit(**INNER)
def grazes(i, y, acceleration, theta, settings):
    """Whether an event at a stop whose force jumps is so slow that errors decide the jump of the momenta.

    Whether the stop is touched at all, and by how much p₁ jumps, depends on the speed. Its square is known to the
    tolerance times (a/ω_n)², for the mass has been near to the stop for v/a, out of times of 1/ω_n: below ten times
    that, v is uncertain by more than some 5 %. Nor is it known where x is rounded. Without momentum nothing jumps.
    """
    if not jumps_at(i, theta) or y[STATES + 1] == 0.0:
        return False
    if is_clamped(i, theta) and push_at(i, y, theta) < 0.0:
        return False  # a law that would pull is cut: no force
    scale, square = acceleration * settings[3], y[1] * y[1]
    return square <= BLURRED * settings[0] * scale * scale or square <= 8.0 * EPSILON * abs(
        stop(i, theta) * acceleration
    )
