"""The stops: a step is shortened to end on an event, a contact is followed to its end.

Inside a step the set of pushing stops is fixed, so the right-hand side is smooth; it changes only between steps. At
most one stop is touched at a time. Lines marked "breaking" or "unbroken" are kept only for scenes and flows in which
something jumps at the touch of a stop, or nothing does; "bending" or "unbent", where a law is cut at zero.
"""

import numpy as np
from numba import njit

from vibrokit.kernels.cubic import crossing, summit
from vibrokit.kernels.stopping import COMPLETED, DIVERGED, STALLED
from vibrokit.kernels.templates.crossing_extremals import cross, turn_law
from vibrokit.kernels.templates.scene import CLAMPED, SIDES, law, rhs, stop
from vibrokit.kernels.templates.settling import SOME_CLAMPED, push_at, settle
from vibrokit.kernels.templates.steps import (
    CLOCK,
    CONTACT_STEP,
    COUNT,
    EPSILON,
    FIRST_STEP,
    INNER,
    PULLED,
    ROOT_DEPTH,
    ROOT_TIME,
    SINCE,
    SPAN,
    SPARE,
    STAGE,
    TIME,
    TIMED,
    TOUCHED,
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

DEPTH_GOAL, RATE_GOAL, LAW_GOAL = 0.0, 1.0, 2.0


@njit(**INNER)
def goal_at(goal, i, y, theta):
    if goal == DEPTH_GOAL:
        return SIDES[i] * (y[0] - stop(i, theta))
    if goal == RATE_GOAL:
        return SIDES[i] * y[1]
    return push_at(i, y, theta)


@njit(**INNER)
def land(goal, course, sigma, h, y, i, pushing, theta, workspace):
    """Shorten a step, after which a goal has changed its sign, to end on its zero; leave that end in TRIAL.

    Newton's method for the depth, whose derivative in time is the rate, secants for the others; bisection where they
    leave the bracket.
    """
    trial = workspace[TRIAL]
    start, value = goal_at(goal, i, y, theta), goal_at(goal, i, trial, theta)
    rising = value > 0.0
    low, high, length, before, last = 0.0, h, h, 0.0, start
    for _ in range(80):
        if goal == DEPTH_GOAL and course == TIME:
            move = -value / (SIDES[i] * trial[1])
        else:
            move = -value * (length - before) / (value - last)
        if length == h and goal == DEPTH_GOAL and course == TIME:
            move = crossing(start, SIDES[i] * y[1], value, SIDES[i] * trial[1], h) - h
        new = length + move
        if not min(low, high) < new < max(low, high):
            new = 0.5 * (low + high)
        before, last = length, value
        length = new
        attempt(course, sigma, length, y, i, pushing, theta, workspace)
        value = goal_at(goal, i, trial, theta)
        if (value > 0.0) == rising:
            high = length
        else:
            low = length
        if value == 0.0 or abs(high - low) <= 2.0 * EPSILON * abs(h):
            break
        if abs(length - before) <= 4.0 * EPSILON * abs(h):
            break
        if goal == DEPTH_GOAL and course == TIME and abs(value) < 1e-9 * abs(h * trial[1]):
            # One more Newton step is exact to rounding here and needs no new attempt.
            move = -value / (SIDES[i] * trial[1])
            rhs(trial[CLOCK], trial, pushing, theta, workspace[SPARE])
            for e in range(CLOCK):
                trial[e] += move * workspace[SPARE, e]
            trial[CLOCK] += move
            return length + move
    return length


@njit(**INNER)
def press(y, end, memory, pushing, theta, settings, workspace):
    """Follow the contact with the touched stop until it ends, or to the end time."""
    touched = memory[TOUCHED]
    while y[CLOCK] < end and memory[TOUCHED] == touched:
        status = press_step(int(touched), y, end, memory, pushing, theta, settings, workspace)
        if status != COMPLETED:
            return status
    return COMPLETED


@njit(**INNER)
def course_of(i, y, memory, theta, workspace):
    """Choose the course of the next step in contact, and where on it y lies."""
    depth, rate = SIDES[i] * (y[0] - stop(i, theta)), SIDES[i] * y[1]
    if memory[PULLED] == 0.0 and rate < 0.0 and depth > 0.0 and memory[TIMED] == 0.0:
        acceleration = SIDES[i] * workspace[0, 1]
        if rate * rate > (4.0 if acceleration > 0.0 else -1.0) * acceleration * depth:
            return ROOT_DEPTH, np.sqrt(depth)
    if memory[PULLED] == 0.0 and np.isfinite(memory[SINCE]):
        return ROOT_TIME, np.sqrt(y[CLOCK] - memory[SINCE])
    return TIME, 0.0


@njit(**INNER)
def length_of(course, sigma, lapse, i, y, theta):
    """Length along a course of a step that lasts `lapse`."""
    if course == ROOT_TIME:
        return lapse / (np.sqrt(sigma * sigma + lapse) + sigma)
    if course == ROOT_DEPTH:
        square = sigma * sigma + SIDES[i] * y[1] * lapse
        return np.sqrt(square) - sigma if square > 0.02 * sigma * sigma else -sigma
    return lapse


@njit(**INNER)
def press_step(i, y, end, memory, pushing, theta, settings, workspace):
    """One step in contact, on the course that is chosen for it."""
    trial = workspace[TRIAL]
    rhs(y[CLOCK], y, pushing, theta, workspace[0])
    course, sigma = course_of(i, y, memory, theta, workspace)
    remaining = end - y[CLOCK]
    last = course != ROOT_DEPTH and memory[CONTACT_STEP] >= 0.99 * remaining
    h = length_of(course, sigma, remaining if last else memory[CONTACT_STEP], i, y, theta)
    copy(y, workspace[STAGE])
    slope(course, sigma, h, i, pushing, theta, workspace, int(ZERO))
    depth = max(SIDES[i] * (y[0] - stop(i, theta)), 1e-30)
    grain = grain_of(i, depth, y, theta)
    first, before, misses = h, np.inf, 0
    while True:
        memory[COUNT] += 1.0
        if memory[COUNT] > settings[1]:
            return STALLED
        attempt(course, sigma, h, y, i, pushing, theta, workspace)
        haze = 4.0 * EPSILON * abs(y[0]) / max(depth, SIDES[i] * (trial[0] - stop(i, theta)))
        error = misfit(h, y, memory[SPAN], settings[0], grain, haze, workspace)
        lapse = trial[CLOCK] - y[CLOCK]
        tiny = abs(lapse) <= EPSILON * (abs(y[CLOCK]) + memory[SPAN]) or abs(h) < 1e-12 * abs(first)
        if error > 1.0 and not tiny and misses < 2:
            misses = misses + 1 if stuck(error, before, settings[0]) else 0
            before = error
            h *= min(0.7, stretch(error))
            continue
        if not np.isfinite(error):
            return DIVERGED
        if course == ROOT_DEPTH:
            if trial[CLOCK] > end or SIDES[i] * trial[1] >= 0.0:
                memory[TIMED] = 2.0 if trial[CLOCK] > end else 1.0
                return COMPLETED
        elif memory[PULLED] == 0.0 and not tiny and leaves(i, y, lapse, theta, trial):
            h *= 0.5
            continue
        break
    whole = last and h == first
    return conclude(i, course, sigma, h, whole, error, y, end, memory, pushing, theta, settings, workspace)


@njit(**INNER)
def grain_of(i, depth, y, theta):
    """Uncertainty of the law due to the rounding of x."""
    more = 0.5 * depth + 64.0 * EPSILON * abs(y[0])
    rate = SIDES[i] * y[1]
    return 3.0 * EPSILON * abs(y[0]) * abs(law(i, depth + more, rate, theta) - law(i, depth, rate, theta)) / more


@njit(**INNER)
def leaves(i, y, lapse, theta, trial):
    """Whether a step in time ends outside the stop, or may have been outside between."""
    wall, before, after = stop(i, theta), SIDES[i] * y[1], SIDES[i] * trial[1]
    end = SIDES[i] * (trial[0] - wall)
    if end < -4.0 * EPSILON * abs(wall):
        return True
    if before < 0.0 < after:
        start = SIDES[i] * (y[0] - wall)
        least = -summit(-start, -before, -end, -after, lapse)
        return least < 0.1 * (max(start, end) - least)
    return False


@njit(**INNER)
def conclude(i, course, sigma, h, last, error, y, end, memory, pushing, theta, settings, workspace):
    """Accept the step in TRIAL, or the part of it before the law changes its sign or the mass leaves."""
    trial = workspace[TRIAL]
    wall, length, turned = stop(i, theta), h, False
    if SOME_CLAMPED:
        if CLAMPED[i]:
            length, turned = turn(i, course, sigma, h, y, memory, pushing, theta, workspace)
    lapse = trial[CLOCK] - y[CLOCK]
    copy(trial, y)
    if last and length == h:
        y[CLOCK] = end
    plan_contact(course, sigma, length, lapse, last, error, memory)
    if turned:
        memory[PULLED] = 1.0 - memory[PULLED]
        memory[SINCE] = np.nan
        pushing[i] = not pushing[i]  # unbent
        turn_law(i, y, pushing, theta, workspace)  # bending
    elif (course == ROOT_DEPTH and sigma + length == 0.0) or SIDES[i] * (y[0] - wall) <= 0.0:
        y[0] = wall
        settle(y, memory, pushing, theta, workspace[SPARE])  # unbroken
        return cross(i, y, memory, pushing, theta, settings, workspace)  # breaking
    return COMPLETED


@njit(**INNER)
def turn(i, course, sigma, h, y, memory, pushing, theta, workspace):
    """End the step in TRIAL where the law changes its sign, or where a mass that is not pushed leaves the stop."""
    trial, wall = workspace[TRIAL], stop(i, theta)
    before, after = push_at(i, y, theta), push_at(i, trial, theta)
    pulled, length = memory[PULLED] != 0.0, h
    turned = after > 0.0 if pulled else after < 0.0
    if turned and (before < 0.0 if pulled else before > 0.0):
        length = land(LAW_GOAL, course, sigma, h, y, i, pushing, theta, workspace)
    elif turned:
        copy(y, trial)
        length = 0.0
    if pulled and SIDES[i] * (trial[0] - wall) < 0.0:
        turned = False
        length = land(DEPTH_GOAL, course, sigma, length, y, i, pushing, theta, workspace)
        trial[0] = wall
    return length, turned


@njit(**INNER)
def plan_contact(course, sigma, length, lapse, last, error, memory):
    """Choose how long the next step in contact shall last."""
    factor = stretch(error)
    if course == ROOT_TIME:
        if sigma == 0.0:
            memory[FIRST_STEP] = lapse * min(factor, 1.5) ** 2
        longer = factor * length
        lapse = longer * (2.0 * (sigma + length) + longer)
    else:
        lapse *= factor
    if length != 0.0 and not (last and lapse < memory[CONTACT_STEP]):
        memory[CONTACT_STEP] = lapse
    if memory[TIMED] == 1.0:
        memory[TIMED] = 0.0
