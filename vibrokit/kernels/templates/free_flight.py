"""Free flight in closed form: between the stops of a linear scene the Taylor series of the motion is exact.

A touch is the first zero of a polynomial. The search for it cannot miss one: from each point it advances only as far
as bounds on the second and third derivative exclude a zero.
"""

import numpy as np
from numba import njit

from vibrokit.kernels.intrinsics import offset_by
from vibrokit.kernels.links import flight_rate, taylor
from vibrokit.kernels.options import INNER
from vibrokit.kernels.stopping import COMPLETED, STALLED

# The task of a flight that goes on after the next attempt; steps from one such pause to the next.
FLIES, PAUSE = 5.0, 1024.0


@njit(**INNER)
def fly(lane, memory, pushing, theta, settings, lanes, room):
    """Follow the free motion until a stop is touched, or to the end time."""
    y, series, reach = room, offset_by(room, SERIES), 1.5 / flight_rate(theta)
    take(STATE, lane, lanes, y)
    while y[CLOCK] < memory[END]:
        memory[COUNT] += 1.0
        if memory[COUNT] > settings[1]:
            return STALLED
        if memory[COUNT] % PAUSE == 0.0:
            memory[TASK] = FLIES
            put(y, STATE, lane, lanes)
            return UNDERWAY
        remaining = memory[END] - y[CLOCK]
        last = remaining <= 1.01 * reach
        length, touched = remaining if last else reach, -1
        taylor(y[CLOCK], y, theta, series)
        if STOPS:
            touched, length = first_touch(length, theta, series)
        for e in range(size_of(lanes)):
            value = series[e * TERMS + ORDER]
            for k in range(ORDER - 1, -1, -1):
                value = value * length + series[e * TERMS + k]
            y[e] = value
        y[CLOCK] = memory[END] if last and touched < 0 else y[CLOCK] + length
        if STOPS:
            if touched >= 0:
                put(y, STATE, lane, lanes)
                return meet(touched, lane, memory, pushing, theta, settings, lanes, room)
    put(y, STATE, lane, lanes)
    return COMPLETED


@njit(**INNER)
def judge(lane, memory, pushing, theta, settings, lanes, room):
    """Go on after a pause of the flight, or judge an attempt in contact: ask for another, or go on from its end."""
    if memory[TASK] == FLIES:
        memory[TASK] = STEPS
        return COMPLETED
    if STOPS:
        if memory[TASK] == STEPS:
            return judge_contact(lane, memory, pushing, theta, settings, lanes, room)
        if landed(lane, memory, pushing, theta, lanes, room):
            return conclude_landing(lane, memory, pushing, theta, settings, lanes, room)
    return UNDERWAY


@njit(**INNER)
def first_touch(length, theta, c):
    """Stop that is touched first within `length` (−1: none), and the moment."""
    size, second, third = abs(c[0]) + abs(c[1]) * length, 0.0, 0.0
    power = 1.0  # length^(k − 2)
    for k in range(2, ORDER + 1):
        term = abs(c[k]) * power
        size += term * length * length
        second += k * (k - 1) * term
        third += k * (k - 1) * (k - 2) * term / length
        power *= length
    touched, moment = -1, length
    for i in range(barriers(theta)):
        s = touch_of(i, moment, size, second, third, theta, c)
        if s < moment:
            touched, moment = i, s
    return touched, moment


@njit(**INNER)
def touch_of(i, length, size, second, third, theta, c):
    """First moment before `length` at which a stop is touched, or `length`.

    `size`, `second` and `third` bound x and its derivatives. A contact too shallow for x to represent does not count.
    """
    wall, side, s = stop(i, theta), side_of(i, theta), 0.0
    rounding = EPSILON * (4.0 * abs(wall) + 2.0 * size)
    for _ in range(300):
        x, v, a = c[ORDER], 0.0, 0.0
        for k in range(ORDER - 1, -1, -1):
            a = a * s + v
            v = v * s + x
            x = x * s + c[k]
        gap, closing, pull = side * (wall - x), side * v, 2.0 * side * a
        if s == 0.0 and gap == 0.0:
            closing = min(closing, 0.0)  # it starts here and is free, so it leaves
        elif closing > 0.0 and gap <= max(rounding, 4.0 * EPSILON * closing * length):
            if pull >= 0.0 or closing * closing > -2.0 * pull * rounding:
                return min(max(s + gap / closing, 0.0), length)
            closing = 0.0
        ahead = max(clear_ahead(max(gap, 0.0), closing, pull, second, third), 4.0 * EPSILON * length)
        if ahead == 4.0 * EPSILON * length and closing <= 0.0:
            ahead = 6e-6 * length  # at rest at the stop without acceleration: x does not change in this time
        s += ahead
        if s >= length:
            return length
    return s


@njit(**INNER)
def clear_ahead(gap, closing, pull, second, third):
    """A time during which the gap certainly stays open."""
    root = np.sqrt(closing * closing + 2.0 * second * gap)
    if closing > 0.0:
        ahead = 2.0 * gap / (closing + root)
        if pull < 0.0:
            ahead = max(ahead, min(gap / closing, -pull / third))
        return ahead
    ahead = (root - closing) / second if second > 0.0 else np.inf
    if pull < 0.0:
        ahead = max(ahead, -3.0 * pull / third)
    return ahead
