"""From section to section, for steppers that locate their events.

Some work after it began, `advance` returns to Python, and goes on when it is called with the same memory again: a
trajectory has the same bits wherever it was cut.
"""

import numpy as np
from numba import njit

from vibrokit.kernels.intrinsics import offset_by, pointer_to
from vibrokit.kernels.links import LINKS
from vibrokit.kernels.options import INNER, OPTIONS
from vibrokit.kernels.stopping import COMPLETED, DIVERGED, LEFT_REGION, stop_status, turned_outside


@njit(**INNER)
def begin(y, interval, lane, memory, pushing, theta, settings, lanes, room):
    """Reset the memory of a lane, so that the motion depends on y alone.

    The first steps are those that a free oscillation and the contacts of ``hertz-0.570`` were observed to need.
    """
    memory[SPAN] = abs(interval)
    memory[FREE_STEP] = min(interval, 6.0 * settings[0] ** 0.125 * settings[3])
    memory[FIRST_STEP] = memory[FREE_STEP] / 64.0
    memory[CONTACT_STEP] = memory[FIRST_STEP]
    memory[TOUCHED], memory[DEEP] = -1.0, 0.0
    if STOPS:
        settle(y, memory, pushing, theta, offset_by(room, ROW))
        face(lane, memory, pushing, theta, lanes)
    put(y, STATE, lane, lanes)


@njit(**INNER)
def travel(end, memory):
    """Begin to integrate a lane to the time `end`."""
    memory[COUNT], memory[TIMED], memory[END] = 0.0, 0.0, end


@njit(**INNER)
def proceed(status, lane, memory, pushing, theta, settings, lanes, room):
    """Ask for the next step of a lane; return its status, `UNDERWAY` before the end time."""
    while status == COMPLETED and of(STATE, CLOCK, lane, lanes) < memory[END]:
        if STOPS and memory[TOUCHED] >= 0.0:
            status = press(int(memory[TOUCHED]), lane, memory, pushing, theta, settings, lanes, room)
        else:
            status = fly(lane, memory, pushing, theta, settings, lanes, room)
    if status == COMPLETED:
        for e in range(size_of(lanes)):
            if not np.isfinite(of(STATE, e, lane, lanes)):
                return DIVERGED
    return status


@njit(**INNER)
def clear(lane, stops, lanes):
    """Leave numbers in an idle lane that attempts can work with."""
    for number in range(lane - stops * LANES, NUMBERS, LANES):
        lanes[number] = 0.0


def memory_of(states, parameters, settings, streams):
    """What `advance` keeps from call to call; the last array has what waits and what is active."""
    stops = int(parameters[int(parameters[0]) - 1 - LINKS])
    numbers, switches = np.zeros(stops * LANES + ROOM), np.zeros(LANES * max(stops, 1), dtype=np.uint8)
    holder, done, ended = np.full(LANES, -1), np.zeros(LANES, dtype=np.int64), np.full(LANES, UNDERWAY)
    return numbers, switches, holder, done, ended, np.zeros(2, dtype=np.int64)


@njit(**OPTIONS)
def advance(
    states,
    parameters,
    start_time,
    interval,
    options,
    streams,  # none: a random force has no order 8
    given,
    budget,
    phases,
    keep,
    test,
    outputs,  # (states, intervals, status, label, visits): written here
    memory,  # of `memory_of`
    most,  # attempts and intervals before it returns
):
    out_states, out_intervals, out_status, out_label, visits = outputs
    every, region, between, area, labels, home, points, point_labels, metrics, turn = test
    # Trajectory in each lane (−1 for none), intervals that it has passed, and how one ended that is not concluded yet.
    numbers, switches, holder, done, ended, place = memory
    facts, theta = offset_by(pointer_to(parameters), 1), offset_by(pointer_to(parameters), int(parameters[0]))
    settings, stops = pointer_to(options), barriers(theta)
    lanes, pushing = offset_by(pointer_to(numbers), stops * LANES), pointer_to(switches)
    room = offset_by(lanes, WORK)
    y, equations = room, states.shape[1]
    lanes[SIZE] = equations
    cycle = int(settings[2])  # intervals after which the forcing repeats; 0 if it never does
    goes_on = settings[4] > 0.0  # for this time; otherwise each interval begins anew
    span = settings[4] if goes_on else interval
    count, waiting, active, used = states.shape[0], place[0], place[1], 0
    while used < most and (waiting < count or active > 0):
        for lane in range(LANES):
            own, pushed = offset_by(room, MEMORIES + lane * MEMORY), offset_by(pushing, lane * max(stops, 1))
            status = UNDERWAY
            if holder[lane] >= 0:
                status = ended[lane]
                if status == UNDERWAY:
                    status = judge(lane, own, pushed, theta, settings, lanes, room)
                    status = proceed(status, lane, own, pushed, theta, settings, lanes, room)
            while used < most and (status != UNDERWAY or (holder[lane] < 0 and waiting < count)):
                used += 1 + int(own[COUNT])
                begins = True
                if holder[lane] >= 0:  # an interval has ended
                    index, label, begins = holder[lane], -1, not goes_on
                    if status == COMPLETED:
                        x, v = out_states[index, 0], out_states[index, 1]
                        for e in range(equations):
                            out_states[index, e] = of(STATE, e, lane, lanes)
                        done[lane] += 1
                        passed = phases[index] + done[lane]
                        at_section = passed % every == 0
                        if visits.shape[1] > 0 and passed % keep == 0:
                            visit = (passed // keep - phases[index] // keep - 1) % visits.shape[1]
                            for e in range(equations):
                                visits[index, visit, e] = out_states[index, e]
                        here = out_states[index, 0], out_states[index, 1]
                        status, label = stop_status(
                            *here, at_section, region, area, labels, home, points, point_labels, metrics, turn
                        )
                        if between and status == COMPLETED:
                            if turned_outside(x, v, here[0], here[1], interval, region):
                                status = LEFT_REGION
                    if status != COMPLETED or done[lane] >= budget[index]:
                        out_intervals[index], out_status[index], out_label[index] = done[lane], status, label
                        holder[lane], status = -1, UNDERWAY
                        active -= 1
                        clear(lane, stops, lanes)
                        continue
                else:
                    index, waiting = waiting, waiting + 1
                    for e in range(equations):
                        out_states[index, e] = states[index, e]
                    out_intervals[index], out_status[index], out_label[index] = 0, COMPLETED, -1
                    if budget[index] <= 0:
                        continue
                    holder[lane], done[lane] = index, 0
                    active += 1
                # Where the forcing repeats, so do the times: the phase cannot drift.
                passed = phases[index] + done[lane]
                start = start_time + (passed % cycle if cycle > 0 else passed) * interval
                if begins:
                    for e in range(equations):
                        y[e] = out_states[index, e]
                    y[CLOCK] = start
                    begin(y, span, lane, own, pushed, theta, settings, lanes, room)
                travel(start + interval, own)
                status = proceed(COMPLETED, lane, own, pushed, theta, settings, lanes, room)
            ended[lane] = status
        used += 1
        if active > 0:
            attempt(lanes, pushing, theta, room, facts)
            misfit(lanes, settings[0], abs(span), settings[6], facts)
    place[0], place[1] = waiting, active
    return used
