"""Periods of conservative motion against one stop, by quadrature at 50 digits: independent of every stepper."""

import math

import mpmath

DIGITS = 50
STEPS = 8  # about those of one contact, in each of which the position is rounded


def exact_period(stiffness: float, power: float, place: float, speed: float) -> float:
    """Period of x″ + x = −k (x − b)₊^p from (0, speed), b ≥ 0, where the stop is reached or not.

    Left of 0 the motion is a harmonic half period. Right of it time is ∫ dx / velocity, first to the stop, then to the
    turning point and back.
    """
    with mpmath.workdps(DIGITS):
        k, p, b, s = map(mpmath.mpf, (stiffness, power, place, speed))
        if s <= b:
            return float(2 * mpmath.pi)
        free = mpmath.asin(b / s)

        def square(depth):  # velocity squared
            return s**2 - (b + depth) ** 2 - 2 * k * depth ** (p + 1) / (p + 1)

        rigid = s - b  # the turning point without the stop bounds the depth
        soft = ((p + 1) * (s**2 - b**2) / (2 * k)) ** (1 / (p + 1))
        low, high = mpmath.mpf(0), min(rigid, soft)
        for _ in range(180):
            middle = (low + high) / 2
            low, high = (middle, high) if square(middle) > 0 else (low, middle)

        # depth = low (1 − u²) makes the square root at the turning point smooth; near the stop depth^(p+1) is not, so
        # the pieces shrink towards it.
        def integrand(u):
            return 2 * low * u / mpmath.sqrt(square(low * (1 - u**2)))

        pieces = [0, *(1 - mpmath.mpf(2) ** -n for n in range(1, 25)), 1]
        contact = mpmath.quad(integrand, pieces, method="gauss-legendre")
        return float(mpmath.pi + 2 * (free + contact))


def rounding_after(cycles: int, stiffness: float, power: float, place: float, speed: float) -> float:
    """Error in x after whole periods if each step in contact rounds the position by half a unit in the same direction.

    The force times the error in position is one in energy, which changes every later period.
    """
    energy = (speed**2 - place**2) / 2
    force = stiffness ** (1 / (power + 1)) * ((power + 1) * energy) ** (power / (power + 1))
    slower = place + (speed - place) * 0.999
    by_speed = (exact_period(stiffness, power, place, speed) - exact_period(stiffness, power, place, slower)) / (
        speed - slower
    )
    lost = STEPS * force * math.ulp(place) / 2 / speed  # of the speed, in each contact
    return speed * abs(by_speed) * lost * cycles**2 / 2
