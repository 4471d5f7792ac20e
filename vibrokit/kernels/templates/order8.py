"""Free flight by steps of order 8, each ended at the first touch of a stop."""

import numpy as np
from numba import njit

from vibrokit.kernels.cubic import summit
from vibrokit.kernels.stopping import COMPLETED, DIVERGED, STALLED
from vibrokit.kernels.templates.crossing_extremals import cross
from vibrokit.kernels.templates.located import DEPTH_GOAL, RATE_GOAL, land
from vibrokit.kernels.templates.scene import BARRIERS, SIDES, stop
from vibrokit.kernels.templates.settling import settle
from vibrokit.kernels.templates.steps import (
    CLOCK,
    COUNT,
    EPSILON,
    FREE_STEP,
    INNER,
    SPAN,
    SPARE,
    STAGE,
    TIME,
    TRIAL,
    ZERO,
    attempt,
    copy,
    misfit,
    slope,
    stretch,
    stuck,
)

# --- scene above, stepper below ---

CLEAR, TOO_LONG = -1, -2  # what `watch` finds in a step, or the stop that it runs into


@njit(**INNER)
def fly(y, end, memory, pushing, theta, settings, workspace, coefficients):
    """Follow the free motion until a stop is touched, or to the end time."""
    trial, none = workspace[TRIAL], int(ZERO)  # no stop decides the course
    while y[CLOCK] < end:
        remaining = end - y[CLOCK]
        last = memory[FREE_STEP] >= 0.99 * remaining
        h = remaining if last else memory[FREE_STEP]
        first, touched, length, before, misses = h, CLEAR, h, np.inf, 0
        copy(y, workspace[STAGE])
        slope(TIME, 0.0, h, none, pushing, theta, workspace, int(ZERO))
        while True:
            memory[COUNT] += 1.0
            if memory[COUNT] > settings[1]:
                return STALLED
            attempt(TIME, 0.0, h, y, none, pushing, theta, workspace)
            error = misfit(h, y, memory[SPAN], settings[0], 0.0, 0.0, workspace)
            tiny = h <= EPSILON * (abs(y[CLOCK]) + memory[SPAN])
            if error > 1.0 and not tiny and misses < 2:
                misses = misses + 1 if stuck(error, before, settings[0]) else 0
                before = error
                h *= min(0.7, stretch(error))
                continue
            if not np.isfinite(error):
                return DIVERGED
            length = h
            if BARRIERS > 0:
                touched, length = watch(h, tiny, y, pushing, theta, workspace)
                if touched == TOO_LONG:
                    h *= 0.5
                    continue
            break
        if touched == CLEAR and not (last and h == first and h * stretch(error) < memory[FREE_STEP]):
            memory[FREE_STEP] = h * stretch(error)
        copy(trial, y)
        if last and length == first:
            y[CLOCK] = end
        if BARRIERS > 0 and touched >= 0:
            y[0] = stop(touched, theta)
            settle(y, memory, pushing, theta, workspace[SPARE])  # unbroken
            return COMPLETED  # unbroken
            return cross(touched, y, memory, pushing, theta, settings, workspace)  # breaking
    return COMPLETED


@njit(**INNER)
def watch(h, tiny, y, pushing, theta, workspace):
    """Find a touch within the step in TRIAL and shorten the step to end on it; return the stop, and the length."""
    trial = workspace[TRIAL]
    for i in range(BARRIERS):
        wall, side = stop(i, theta), SIDES[i]
        before, after = side * (y[0] - wall), side * (trial[0] - wall)
        turns, up = turns_of(side, trial[1], workspace)
        if turns > 1 and not tiny:
            return TOO_LONG, h
        if after > 0.0:
            if before < 0.0:
                return i, land(DEPTH_GOAL, TIME, 0.0, h, y, i, pushing, theta, workspace)
            if not tiny:
                return TOO_LONG, h  # it left and returned within the step
            return i, h
        if turns == 1 and up:
            rise, fall = side * y[1], side * trial[1]
            if not (rise > 0.0 > fall):
                continue
            top = summit(before, rise, after, fall, h)
            if top + 0.3 * (top - min(before, after)) <= 0.0:
                continue
            turn = land(RATE_GOAL, TIME, 0.0, h, y, i, pushing, theta, workspace)
            if side * (trial[0] - wall) > 0.0 and before < 0.0:
                return i, land(DEPTH_GOAL, TIME, 0.0, turn, y, i, pushing, theta, workspace)
            if side * (trial[0] - wall) > 0.0 and not tiny:
                return TOO_LONG, h
            return CLEAR, turn
    return CLEAR, h


@njit(**INNER)
def turns_of(side, final, workspace):
    """Number of turns within a step, by its stages, and whether the first is away from a stop."""
    largest = max(abs(workspace[0, 0]), abs(workspace[5, 0]), abs(final))
    turns, up, before = 0, False, 0.0
    for s in (0, 3, 5, 9, 10, 12):
        rate = side * (final if s == 12 else workspace[s, 0])
        if abs(rate) < 1e-3 * largest:
            continue
        if rate * before < 0.0:
            if turns == 0:
                up = before > 0.0
            turns += 1
        before = rate
    return turns, up
