"""Steps that are shortened to end on an event: a touch, a turn of the motion, or where a law changes its sign."""

from numba import njit

from vibrokit.kernels.cubic import crossing
from vibrokit.kernels.intrinsics import offset_by
from vibrokit.kernels.links import rhs
from vibrokit.kernels.options import INNER

DEPTH_GOAL, RATE_GOAL, LAW_GOAL = 0.0, 1.0, 2.0


@njit(**INNER)
def depth_at(offset, i, lane, lanes, theta):
    return side_of(i, theta) * (of(offset, 0, lane, lanes) - stop(i, theta))


@njit(**INNER)
def goal_at(goal, i, offset, lane, lanes, theta):
    if goal == DEPTH_GOAL:
        return depth_at(offset, i, lane, lanes, theta)
    if goal == RATE_GOAL:
        return side_of(i, theta) * of(offset, 1, lane, lanes)
    return push_of(i, of(offset, 0, lane, lanes), of(offset, 1, lane, lanes), theta)


@njit(**INNER)
def land(task, goal, i, length, lane, memory, theta, lanes):
    """Begin to shorten a step, after which a goal has changed its sign, to end on its zero."""
    memory[TASK], memory[GOAL], memory[AIM], memory[WHOLE] = task, goal, i, length
    value = goal_at(goal, i, TRIAL, lane, lanes, theta)
    memory[RISING] = 1.0 if value > 0.0 else 0.0
    memory[LOW], memory[HIGH], memory[SHORTER], memory[TRIES] = 0.0, length, 0.0, 0.0
    memory[VALUE] = goal_at(goal, i, STATE, lane, lanes, theta)
    aim(length, value, lane, memory, theta, lanes)


@njit(**INNER)
def aim(length, value, lane, memory, theta, lanes):
    """Ask for an attempt of a better length.

    Newton's method for the depth, whose derivative in time is the rate, secants for the others; bisection where they
    leave the bracket.
    """
    i, h = int(memory[AIM]), memory[WHOLE]
    if memory[GOAL] == DEPTH_GOAL and lanes[COURSE + lane] == TIME:
        rate = side_of(i, theta) * of(TRIAL, 1, lane, lanes)
        move = -value / rate
        if length == h:
            before = side_of(i, theta) * of(STATE, 1, lane, lanes)
            move = crossing(memory[VALUE], before, value, rate, h) - h
    else:
        move = -value * (length - memory[SHORTER]) / (value - memory[VALUE])
    new = length + move
    if not min(memory[LOW], memory[HIGH]) < new < max(memory[LOW], memory[HIGH]):
        new = 0.5 * (memory[LOW] + memory[HIGH])
    memory[SHORTER], memory[VALUE] = length, value
    lanes[LENGTH + lane] = new


@njit(**INNER)
def landed(lane, memory, pushing, theta, lanes, room):
    """Judge an attempt to land; return whether its end is the event. Otherwise ask for another."""
    goal, i, h, length = memory[GOAL], int(memory[AIM]), memory[WHOLE], lanes[LENGTH + lane]
    value = goal_at(goal, i, TRIAL, lane, lanes, theta)
    if (value > 0.0) == (memory[RISING] > 0.0):
        memory[HIGH] = length
    else:
        memory[LOW] = length
    memory[TRIES] += 1.0
    if value == 0.0 or abs(memory[HIGH] - memory[LOW]) <= 2.0 * EPSILON * abs(h) or memory[TRIES] >= 80.0:
        return True
    if abs(length - memory[SHORTER]) <= 4.0 * EPSILON * abs(h):
        return True
    rate = of(TRIAL, 1, lane, lanes)
    if goal == DEPTH_GOAL and lanes[COURSE + lane] == TIME and abs(value) < 1e-9 * abs(h * rate):
        # One more Newton step is exact to rounding here and needs no new attempt.
        y, slope, move = room, offset_by(room, ROW), -value / (side_of(i, theta) * rate)
        take(TRIAL, lane, lanes, y)
        rhs(y[CLOCK], y, pushing, theta, slope)
        for e in range(size_of(lanes)):
            y[e] += move * slope[e]
        y[CLOCK] += move
        put(y, TRIAL, lane, lanes)
        lanes[LENGTH + lane] = length + move
        return True
    aim(length, value, lane, memory, theta, lanes)
    return False
