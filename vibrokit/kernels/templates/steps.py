"""Steps of order 8 that all lanes of a block attempt together, each of its own length and along its own course.

A half-integer law makes the force go like (t − t_c)^(3/2) after a touch at t_c: every method loses its order there. In
τ = √(t − t_c) the motion is analytic from the touch through the turning point, and in u = √depth it is analytic down
to the moment the mass leaves, which is at u = 0 exactly. So the time is a component of the state, y = (t, z),
and a step may run along any of three courses. Quarter powers, and others, take the fourth roots instead.

Between attempts each lane decides for itself how its motion goes on. It keeps in its memory what it is about, and asks
for the next attempt; so no lane waits for another, and what it does depends on its own state alone.
"""

import numpy as np
from numba import njit

from vibrokit.kernels.links import LINKS
from vibrokit.kernels.options import INNER
from vibrokit.kernels.stopping import STALLED

# Numba compiles a function again for each integer constant that it is called with, so these are no integers.
TIME, ROOT_TIME, ROOT_DEPTH = 0.0, 1.0, 2.0
UNDERWAY = -1  # the status of a lane that waits for an attempt
# Memory of a lane between attempts. Durations of the next step in free flight, in contact and at the next touch, the
# stop that is touched (−1: none), since when (nan: unknown), whether its law would pull, whether the next step must run
# in time, the number of attempts, the time to integrate over, and its end; whether the last step in a contact ran in
# the root of the depth.
FREE_STEP, CONTACT_STEP, FIRST_STEP, TOUCHED, SINCE, PULLED, TIMED, COUNT, SPAN, END = 0, 1, 2, 3, 4, 5, 6, 7, 8, 9
DEEP = 25
# Of a step: the length it was begun with, whether it is to reach the end, the error before, and how often shortening
# the step did not reduce it.
FIRST, LAST, BEFORE, MISSES = 10, 11, 12, 13
# Of a step that is shortened to end on an event: its task, the goal and its stop, the full length and its error, the
# bracket, the length and the value before, whether the value rises, and the number of attempts.
TASK, GOAL, AIM, WHOLE, TAKEN, LOW, HIGH, SHORTER, VALUE, RISING, TRIES = 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24
MEMORY = 26
# The tasks: to take steps, or to land on an event, which says what follows.
STEPS, TOUCHES, TURNS, FLIPS, RELEASES = 0.0, 1.0, 2.0, 3.0, 4.0
# Room beside the numbers of the lanes: a state, rows for slopes that events work in, the memories, and a series.
MEMORIES = 5 * ROW
SERIES = MEMORIES + LANES * MEMORY
SIZE = NUMBERS  # where the number of variables is
WORK = NUMBERS + 2  # where the room is, after the time of its first state
ROOM = WORK + SERIES + TERMS * ROW
EPSILON = 2.220446049250313e-16
MORE = 99.0  # attempts that a tiny one counts as, besides itself


@njit(**INNER)
def barriers(theta):
    """Number of stops. Before it is what jumps at them, and before that are five facts of each stop."""
    return int(theta[-1 - LINKS])


@njit(**INNER)
def what_jumps(theta):
    """What jumps at the touch of a stop; see `vibrokit.kernels.located`."""
    return theta[-2 - LINKS]


@njit(**INNER)
def derivatives(theta):
    """Where the derivatives M begin among the variables; 0 for none."""
    return int(theta[-3 - LINKS])


@njit(**INNER)
def covariance(theta):
    """Where the triangle of the covariance begins among the variables; 0 for none."""
    return int(theta[-4 - LINKS])


@njit(**INNER)
def stop(i, theta):
    """Position of a stop."""
    return theta[-5 - LINKS - 5 * i]


@njit(**INNER)
def side_of(i, theta):
    """1 for a stop on the right, −1 for one on the left."""
    return theta[-6 - LINKS - 5 * i]


@njit(**INNER)
def smoothing_of(i, theta):
    """The root of the depth that the law of a stop is smooth in: 1, 2 or 4."""
    return theta[-7 - LINKS - 5 * i]


@njit(**INNER)
def is_clamped(i, theta):
    """Whether the law of a stop is cut at zero where it would pull."""
    return theta[-8 - LINKS - 5 * i] > 0.0


@njit(**INNER)
def jumps_at(i, theta):
    """Whether the force of a stop jumps at first touch."""
    return theta[-9 - LINKS - 5 * i] > 0.0


@njit(**INNER)
def power_of(root, sigma):
    """Sigma to a power of 2 or 4."""
    square = sigma * sigma
    return square * square if root > 3.0 else square


@njit(**INNER)
def root_of(root, number):
    """The square root of a number, or its fourth root."""
    first = np.sqrt(number)
    return np.sqrt(first) if root > 3.0 else first


@njit(**INNER)
def size_of(lanes):
    """Number of variables."""
    return int(lanes[SIZE])


@njit(**INNER)
def take(offset, lane, lanes, y):
    """Copy a state of a lane."""
    for e in range(CLOCK, size_of(lanes)):
        y[e] = lanes[offset + e * LANES + lane]


@njit(**INNER)
def put(y, offset, lane, lanes):
    """Replace a state of a lane."""
    for e in range(CLOCK, size_of(lanes)):
        lanes[offset + e * LANES + lane] = y[e]


@njit(**INNER)
def accept(lane, lanes):
    """Make the end of the attempt the state."""
    for e in range(CLOCK, size_of(lanes)):
        lanes[STATE + e * LANES + lane] = lanes[TRIAL + e * LANES + lane]


@njit(**INNER)
def of(offset, e, lane, lanes):
    return lanes[offset + e * LANES + lane]


@njit(**INNER)
def ask(length, lane, memory, settings, lanes):
    """Ask for an attempt of this length; no more than a number of attempts are allowed."""
    memory[COUNT] += 1.0
    if memory[COUNT] > settings[1]:
        return STALLED
    lanes[LENGTH + lane] = length
    return UNDERWAY


@njit(**INNER)
def plan(course, sigma, length, last, grain, depth, lane, memory, settings, lanes):
    """Ask for the first attempt of a step; `last` is whether the step is to reach the end.

    `grain` and `depth` are those of a contact, 0 and infinite in flight.
    """
    memory[TASK], memory[LAST] = STEPS, 1.0 if last else 0.0
    memory[FIRST], memory[BEFORE], memory[MISSES] = length, np.inf, 0.0
    if STOPS:
        lanes[COURSE + lane], lanes[SIGMA + lane] = course, sigma
        lanes[GRAIN + lane], lanes[DEPTH + lane] = grain, depth
    return ask(length, lane, memory, settings, lanes)


@njit(**INNER)
def shortened(error, factor, tiny, lane, memory, settings, lanes):
    """Length of the next attempt after one with too large an error; 0 if the attempt is taken.

    It is taken, too, where shortening the step has not reduced its error, which is then rounding; the next step may be
    longer than this one was at first, lest motion crawls where rounding is all the error that is left. Tiny attempts
    count as many: next to a singular force time does not go on, and motion ends after 2000 of them.
    """
    if tiny:
        memory[COUNT] += MORE
    if not (error > 1.0) or tiny:
        return 0.0
    if memory[MISSES] >= 2.0:
        lanes[FACTOR + lane] = 2.0 * memory[FIRST] / lanes[LENGTH + lane]
        return 0.0
    stuck = error > 0.8 * memory[BEFORE] and error * settings[0] < 1e-6
    memory[MISSES] = memory[MISSES] + 1.0 if stuck else 0.0
    memory[BEFORE] = error
    return lanes[LENGTH + lane] * min(0.8, factor)


@njit(**INNER)
def face(lane, memory, pushing, theta, lanes):
    """Tell the attempts which stop is touched, and whether it pushes."""
    touched = int(memory[TOUCHED])
    for i in range(barriers(theta)):
        lanes[PUSHES - i * LANES + lane] = 1.0 if pushing[i] else 0.0
    lanes[WALL + lane] = stop(touched, theta) if touched >= 0 else 0.0
    lanes[SIDE + lane] = side_of(touched, theta) if touched >= 0 else 1.0
    lanes[ROOT + lane] = max(smoothing_of(touched, theta), 2.0) if touched >= 0 else 2.0
