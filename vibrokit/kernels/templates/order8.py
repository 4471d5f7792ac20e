"""Free flight by steps of order 8, each ended at the first touch of a stop."""

import numpy as np
from numba import njit

from vibrokit.kernels.cubic import summit
from vibrokit.kernels.options import INNER
from vibrokit.kernels.stopping import COMPLETED, DIVERGED


@njit(**INNER)
def fly(lane, memory, pushing, theta, settings, lanes, room):
    """Ask for a step of the free motion."""
    remaining = memory[END] - of(STATE, CLOCK, lane, lanes)
    step = min(memory[FREE_STEP], settings[5])
    last = step >= 0.99 * remaining
    length = remaining if last else step
    return plan(TIME, 0.0, length, last, 0.0, np.inf, lane, memory, settings, lanes)


@njit(**INNER)
def judge(lane, memory, pushing, theta, settings, lanes, room):
    """Judge an attempt: ask for another, or go on from its end."""
    if STOPS:
        if memory[TASK] != STEPS:
            if not landed(lane, memory, pushing, theta, lanes, room):
                return UNDERWAY
            if memory[TASK] >= FLIPS:
                return conclude_landing(lane, memory, pushing, theta, settings, lanes, room)
            return flown_to(lane, memory, pushing, theta, settings, lanes, room)
        if memory[TOUCHED] >= 0.0:
            return judge_contact(lane, memory, pushing, theta, settings, lanes, room)
    length, error = lanes[LENGTH + lane], lanes[ERROR + lane]
    tiny = is_tiny(length, lane, memory, lanes)
    new = shortened(error, lanes[FACTOR + lane], tiny, lane, memory, settings, lanes)
    if new != 0.0:
        return ask(new, lane, memory, settings, lanes)
    if not np.isfinite(error):
        return DIVERGED
    memory[TAKEN] = lanes[FACTOR + lane]
    if STOPS:
        return watch(length, tiny, lane, memory, pushing, theta, settings, lanes, room)
    return free(length, length, lane, memory, lanes)


@njit(**INNER)
def is_tiny(length, lane, memory, lanes):
    return length <= EPSILON * (abs(of(STATE, CLOCK, lane, lanes)) + memory[SPAN])


@njit(**INNER)
def free(length, whole, lane, memory, lanes):
    """Accept an attempt that touches nothing; `whole` is the length of the step before it was shortened to end here."""
    longer = whole * memory[TAKEN]
    reaches = memory[LAST] > 0.0 and whole == memory[FIRST]
    if not (reaches and longer < memory[FREE_STEP]):
        memory[FREE_STEP] = longer
    accept(lane, lanes)
    if reaches and length == whole:
        lanes[STATE + CLOCK * LANES + lane] = memory[END]
    return COMPLETED


@njit(**INNER)
def touch(i, lane, memory, pushing, theta, settings, lanes, room):
    """Accept an attempt that ends at the touch of a stop."""
    accept(lane, lanes)
    return meet(i, lane, memory, pushing, theta, settings, lanes, room)


@njit(**INNER)
def flown_to(lane, memory, pushing, theta, settings, lanes, room):
    """Go on from an event of the flight: a touch, or a turn near a stop, before which it may have been touched."""
    i, whole = int(memory[AIM]), memory[WHOLE]
    if memory[TASK] == TOUCHES:
        return touch(i, lane, memory, pushing, theta, settings, lanes, room)
    memory[TASK] = STEPS
    if depth_at(TRIAL, i, lane, lanes, theta) > 0.0:
        if depth_at(STATE, i, lane, lanes, theta) < 0.0:
            land(TOUCHES, DEPTH_GOAL, i, lanes[LENGTH + lane], lane, memory, theta, lanes)
            return UNDERWAY
        if not is_tiny(whole, lane, memory, lanes):
            return ask(0.5 * whole, lane, memory, settings, lanes)
    return free(lanes[LENGTH + lane], whole, lane, memory, lanes)


@njit(**INNER)
def watch(length, tiny, lane, memory, pushing, theta, settings, lanes, room):
    """Find a touch within the attempt, and shorten the step to end on it."""
    for i in range(barriers(theta)):
        side = side_of(i, theta)
        before, after = depth_at(STATE, i, lane, lanes, theta), depth_at(TRIAL, i, lane, lanes, theta)
        turns, up = turns_of(side, lane, lanes)
        if turns > 1 and not tiny:
            return ask(0.5 * length, lane, memory, settings, lanes)
        if after > 0.0:
            if before < 0.0:
                land(TOUCHES, DEPTH_GOAL, i, length, lane, memory, theta, lanes)
                return UNDERWAY
            if not tiny:  # it left and returned within the step
                return ask(0.5 * length, lane, memory, settings, lanes)
            return touch(i, lane, memory, pushing, theta, settings, lanes, room)
        if turns == 1 and up:
            rise, fall = side * of(STATE, 1, lane, lanes), side * of(TRIAL, 1, lane, lanes)
            if not (rise > 0.0 > fall):
                continue
            top = summit(before, rise, after, fall, length)
            if top + 0.3 * (top - min(before, after)) <= 0.0:
                continue
            land(TURNS, RATE_GOAL, i, length, lane, memory, theta, lanes)
            return UNDERWAY
    return free(length, length, lane, memory, lanes)


@njit(**INNER)
def turns_of(side, lane, lanes):
    """Number of turns within a step, by its stages, and whether the first is away from a stop."""
    row, final = ROW * LANES, of(TRIAL, 1, lane, lanes)
    largest = max(abs(lanes[SLOPES + lane]), abs(lanes[SLOPES + 5 * row + lane]), abs(final))
    turns, up, before = 0, False, 0.0
    for s in (0, 3, 5, 9, 10, 12):
        rate = side * (final if s == 12 else lanes[SLOPES + s * row + lane])
        if abs(rate) < 1e-3 * largest:
            continue
        if rate * before < 0.0:
            if turns == 0:
                up = before > 0.0
            turns += 1
        before = rate
    return turns, up
