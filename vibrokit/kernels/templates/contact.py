"""The stops: a contact is followed to its end.

Inside a step the set of pushing stops is fixed, so the right-hand side is smooth; it changes only between steps. At
most one stop is touched at a time.
"""

import numpy as np
from numba import njit

from vibrokit.kernels.cubic import summit
from vibrokit.kernels.intrinsics import offset_by
from vibrokit.kernels.links import law, rhs
from vibrokit.kernels.located import EXTREMALS
from vibrokit.kernels.options import INNER
from vibrokit.kernels.stopping import COMPLETED, DIVERGED

# Parts of the expected length that steps were observed to need at tolerances of 1e-4 to 1e-10, with Hertz and linear
# stops of 50 to 1e6: the second step of a contact, and the first in the root of the depth, which begins near the turn
# of the motion, where it is singular.
AFTER_TOUCH, NEAR_TURN = 0.7, 0.35


@njit(**INNER)
def press(i, lane, memory, pushing, theta, settings, lanes, room):
    """Ask for a step in contact, on the course that is chosen for it."""
    now, x = of(STATE, CLOCK, lane, lanes), of(STATE, 0, lane, lanes)
    rate = side_of(i, theta) * of(STATE, 1, lane, lanes)
    course, sigma = course_of(i, lane, memory, pushing, theta, lanes, room)
    remaining, step = memory[END] - now, min(memory[CONTACT_STEP], settings[5])
    last = course != ROOT_DEPTH and step >= 0.99 * remaining
    length = length_of(course, sigma, remaining if last else step, rate, lanes[ROOT + lane])
    if course == ROOT_DEPTH and memory[DEEP] == 0.0:
        length *= NEAR_TURN
    memory[DEEP] = 1.0 if course == ROOT_DEPTH else 0.0
    depth = max(depth_at(STATE, i, lane, lanes, theta), 1e-30)
    grain = grain_of(i, depth, x, rate, step, theta)
    return plan(course, sigma, length, last, grain, depth, lane, memory, settings, lanes)


@njit(**INNER)
def course_of(i, lane, memory, pushing, theta, lanes, room):
    """Choose the course of the next step in contact, and where on it the state lies.

    It runs in the root of the depth where the mass is about to leave: where it turned some time ago, and is fast enough
    to reach the surface `against` the larger of the accelerations here and there. A mass at rest in the stop is not.
    """
    depth, rate = depth_at(STATE, i, lane, lanes, theta), side_of(i, theta) * of(STATE, 1, lane, lanes)
    if memory[PULLED] == 0.0 and rate < 0.0 and depth > 0.0 and memory[TIMED] == 0.0:
        slope = offset_by(room, ROW)
        take(STATE, lane, lanes, room)
        rhs(room[CLOCK], room, pushing, theta, slope)
        acceleration = side_of(i, theta) * slope[1]
        against = max(acceleration, acceleration + law(i, depth, rate, theta) - law(i, 1e-30, rate, theta))
        if rate * rate > max(-acceleration, 4.0 * against) * depth:
            return ROOT_DEPTH, root_of(lanes[ROOT + lane], depth)
    if memory[PULLED] == 0.0 and np.isfinite(memory[SINCE]):
        return ROOT_TIME, root_of(lanes[ROOT + lane], of(STATE, CLOCK, lane, lanes) - memory[SINCE])
    return TIME, 0.0


@njit(**INNER)
def length_of(course, sigma, lapse, rate, root):
    """Length along a course of a step that lasts `lapse`."""
    power = power_of(root, sigma)
    if course == ROOT_TIME:
        end = root_of(root, power + lapse)
        return lapse / ((end + sigma) * (end * end + sigma * sigma if root > 3.0 else 1.0))
    if course == ROOT_DEPTH:
        left = power + rate * lapse
        return root_of(root, left) - sigma if left > 0.02 * power else -sigma
    return lapse


@njit(**INNER)
def grain_of(i, depth, x, rate, lapse, theta):
    """Uncertainty of the law due to the rounding of x, and its own rounding, over a step that lasts `lapse`.

    The slope is the mean one on the way of the step: that at first touch may be infinite, for no time.
    """
    more, force = 0.5 * depth + abs(rate) * lapse + 64.0 * EPSILON * abs(x), law(i, depth, rate, theta)
    return 3.0 * EPSILON * (abs(x) * abs(law(i, depth + more, rate, theta) - force) / more + abs(force))


@njit(**INNER)
def judge_contact(lane, memory, pushing, theta, settings, lanes, room):
    """Judge an attempt in contact: ask for another, or go on from its end."""
    i, course, length = int(memory[TOUCHED]), lanes[COURSE + lane], lanes[LENGTH + lane]
    error, now, then = lanes[ERROR + lane], of(STATE, CLOCK, lane, lanes), of(TRIAL, CLOCK, lane, lanes)
    tiny = abs(then - now) <= EPSILON * (abs(now) + memory[SPAN]) or abs(length) < 1e-12 * abs(memory[FIRST])
    new = shortened(error, lanes[FACTOR + lane], tiny, lane, memory, settings, lanes)
    if new != 0.0:
        return ask(new, lane, memory, settings, lanes)
    if not np.isfinite(error):
        return DIVERGED
    if course == ROOT_DEPTH:
        if then > memory[END] or side_of(i, theta) * of(TRIAL, 1, lane, lanes) >= 0.0:
            memory[TIMED] = 2.0 if then > memory[END] else 1.0
            return COMPLETED
    elif not tiny and leaves(i, then - now, lane, lanes, theta):
        if memory[PULLED] == 0.0 or depth_at(TRIAL, i, lane, lanes, theta) >= 0.0:
            return ask(0.5 * length, lane, memory, settings, lanes)
    if length != memory[FIRST]:
        memory[LAST] = 0.0
    memory[FIRST] = length
    plan_contact(course, lanes[SIGMA + lane], length, then - now, lanes[FACTOR + lane], memory, lanes[ROOT + lane])
    if is_clamped(i, theta):
        return turn(i, tiny, lane, memory, pushing, theta, settings, lanes, room)
    return conclude(i, length, False, lane, memory, pushing, theta, settings, lanes, room)


@njit(**INNER)
def leaves(i, lapse, lane, lanes, theta):
    """Whether a step in time ends outside the stop, or may have been outside between."""
    wall = stop(i, theta)
    before, after = side_of(i, theta) * of(STATE, 1, lane, lanes), side_of(i, theta) * of(TRIAL, 1, lane, lanes)
    end = depth_at(TRIAL, i, lane, lanes, theta)
    if end < -4.0 * EPSILON * abs(wall):
        return True
    if before < 0.0 < after:
        start = depth_at(STATE, i, lane, lanes, theta)
        least = -summit(-start, -before, -end, -after, lapse)
        return least < 0.1 * (max(start, end) - least)
    return False


@njit(**INNER)
def turn(i, tiny, lane, memory, pushing, theta, settings, lanes, room):
    """End a step where the law changes its sign, or where a mass that is not pushed leaves the stop.

    Outside the stop the law says nothing. A law that has just changed its sign may not show it at the start of the
    step, for its value is rounding there; the step is shortened until its end shows it.
    """
    pulled, length = memory[PULLED] != 0.0, lanes[LENGTH + lane]
    if pulled and depth_at(TRIAL, i, lane, lanes, theta) < 0.0:
        # A law that pushes at release began to push within this step: shorter steps find where.
        if not tiny and law(i, 1e-30, side_of(i, theta) * of(TRIAL, 1, lane, lanes), theta) > 0.0:
            return ask(0.5 * length, lane, memory, settings, lanes)
        land(RELEASES, DEPTH_GOAL, i, length, lane, memory, theta, lanes)
        return UNDERWAY
    before = push_of(i, of(STATE, 0, lane, lanes), of(STATE, 1, lane, lanes), theta)
    after = push_of(i, of(TRIAL, 0, lane, lanes), of(TRIAL, 1, lane, lanes), theta)
    turned = after > 0.0 if pulled else after < 0.0
    if turned and (before < 0.0 if pulled else before > 0.0):
        land(FLIPS, LAW_GOAL, i, length, lane, memory, theta, lanes)
        return UNDERWAY
    if turned and not tiny:
        return ask(0.5 * length, lane, memory, settings, lanes)
    if turned:
        for e in range(CLOCK, size_of(lanes)):
            lanes[TRIAL + e * LANES + lane] = lanes[STATE + e * LANES + lane]
        length = 0.0
    return conclude(i, length, turned, lane, memory, pushing, theta, settings, lanes, room)


@njit(**INNER)
def conclude_landing(lane, memory, pushing, theta, settings, lanes, room):
    """Go on from an event within a contact."""
    i, length = int(memory[AIM]), lanes[LENGTH + lane]
    if memory[TASK] == FLIPS:
        memory[TASK] = STEPS
        return conclude(i, length, True, lane, memory, pushing, theta, settings, lanes, room)
    lanes[TRIAL + lane] = stop(i, theta)
    return conclude(i, length, False, lane, memory, pushing, theta, settings, lanes, room)


@njit(**INNER)
def conclude(i, length, turned, lane, memory, pushing, theta, settings, lanes, room):
    """Accept the attempt."""
    course, sigma = lanes[COURSE + lane], lanes[SIGMA + lane]
    accept(lane, lanes)
    if memory[LAST] > 0.0 and length == memory[FIRST]:
        lanes[STATE + CLOCK * LANES + lane] = memory[END]
    y = room
    if turned:
        take(STATE, lane, lanes, y)
        memory[PULLED] = 1.0 - memory[PULLED]
        memory[SINCE] = np.nan
        if what_jumps(theta) >= EXTREMALS:
            turn_law(i, y, pushing, theta, offset_by(room, ROW))
        else:
            pushing[i] = not pushing[i]
        put(y, STATE, lane, lanes)
        face(lane, memory, pushing, theta, lanes)
    elif (course == ROOT_DEPTH and sigma + length == 0.0) or depth_at(STATE, i, lane, lanes, theta) <= 0.0:
        return meet(i, lane, memory, pushing, theta, settings, lanes, room)
    return COMPLETED


@njit(**INNER)
def meet(i, lane, memory, pushing, theta, settings, lanes, room):
    """Go on from a state exactly at a stop."""
    y = room
    take(STATE, lane, lanes, y)
    y[0] = stop(i, theta)
    status = cross(i, y, memory, pushing, theta, settings, offset_by(room, ROW))
    put(y, STATE, lane, lanes)
    face(lane, memory, pushing, theta, lanes)
    return status


@njit(**INNER)
def plan_contact(course, sigma, length, lapse, factor, memory, root):
    """Choose how long the next step in contact shall last, after one that may still be shortened to end on an event.

    How early the event is must not matter: no time may pass before it, and the next step would last as long. Nor may
    the rounding of time: a step that is too short to be seen in it has its length all the same.
    """
    if course == ROOT_TIME:
        if sigma == 0.0:
            memory[FIRST_STEP] = lapse * power_of(root, min(factor, 1.5))
        end, longer = sigma + length, factor * length * (AFTER_TOUCH if sigma == 0.0 else 1.0)
        lapse = power_of(root, end + longer) - power_of(root, end)
    else:
        lapse = factor * (length if course == TIME else lapse)
    if lapse > 0.0 and not (memory[LAST] > 0.0 and lapse < memory[CONTACT_STEP]):
        memory[CONTACT_STEP] = lapse
    if memory[TIMED] == 1.0:
        memory[TIMED] = 0.0
