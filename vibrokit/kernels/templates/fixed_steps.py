"""Runge–Kutta steps of one length, trajectories packed in lanes.

All lanes of a block share the phase of the forcing, so it is tabulated once, for all intervals after which it repeats.
A lane whose trajectory has ended is given the next one as soon as the phase is that of its start.

With noise, a step of length h draws ΔW and ΔZ = ∫W dt exactly and gives them as two kicks, ΔZ/h before a Runge–Kutta
step of the drift and ΔW − ΔZ/h after it, so that the driven state and its integral both receive the right
increments. For additive noise that is weak order 2 in the noise and order 4 in the drift (cf. small-noise methods in
Milstein & Tretyakov, *Stochastic Numerics for Mathematical Physics*); where the amplitude depends on the state that
it drives, Milstein's term makes it strong order 1. `given` normals, if any, replace those that a single trajectory
draws.

One driver serves all scenes and flows; it reads from the facts of a scene what these need. Some steps after it began,
it returns to Python, and goes on when it is called with the same memory again: a trajectory has the same bits wherever
it was cut.
"""

import numpy as np
from numba import njit

from vibrokit.kernels.intrinsics import offset_by, pointer_to, use_widest_registers
from vibrokit.kernels.links import step_lanes, tabulate
from vibrokit.kernels.options import CONTRACTED, INNER_LANES
from vibrokit.kernels.stopping import COMPLETED, DIVERGED, LEFT_REGION, left_in_step, stop_status
from vibrokit.kernels.streams import normal_pair

# Facts, before the parameters of a scene: lanes of a block, whether the forcing depends on time, values of the forcing
# in a step, and rows that a step keeps beside those of the variables.
LANES, FORCED, NODES, ROWS = 1, 2, 3, 4
MOST_STEPS = 4096  # taken in one go


@njit(**INNER_LANES)
def draw_lanes(streams, normals, lanes):
    """Draw two standard normals for each lane, into two rows."""
    use_widest_registers()
    for lane in range(lanes):
        normals[lane], normals[lanes + lane] = normal_pair(streams, lane)


def memory_of(states, parameters, settings, streams):
    """What `advance` keeps from call to call; the last array has what waits and what is active."""
    equations, lanes, nodes = states.shape[1], int(parameters[LANES]), int(parameters[NODES])
    intervals = max(int(settings[1]), 1) if parameters[FORCED] > 0.0 else 0
    z, before = np.zeros((equations + int(parameters[ROWS]), lanes)), np.zeros((equations, lanes))
    tabulated = np.zeros(max(intervals * int(settings[0]) * nodes, 1))
    stream, drawn = np.zeros((4, lanes), dtype=np.uint64), np.zeros(2 * lanes)
    holder, done = np.full(lanes, -1), np.zeros(lanes, dtype=np.int64)
    outside = np.zeros(lanes, dtype=np.bool_)
    return z, before, tabulated, stream, drawn, holder, done, outside, np.array([0, 0, -1, 0])


@njit(**CONTRACTED)
def advance(
    states,
    parameters,
    start_time,
    interval,
    settings,
    streams,  # (count, 4), or (count, 0) without noise
    given,  # (steps, 2): normals that replace those which a single trajectory draws; or (0, 2)
    budget,
    phases,
    keep,
    test,
    ended,  # (states, intervals, status, label, visits): written here
    memory,  # of `memory_of`
    most,  # steps before it returns
):
    out_states, out_intervals, out_status, out_label, visits = ended
    every, region, between, area, labels, home, points, point_labels, metrics, turn = test
    # Trajectory in each lane (−1: none), intervals that it has passed, and whether it was outside in the present one.
    z, before, tabulated, stream, drawn, holder, done, outside, place = memory
    count, equations, lanes, nodes = states.shape[0], states.shape[1], int(parameters[LANES]), int(parameters[NODES])
    forced, noisy, steps = parameters[FORCED] > 0.0, streams.shape[1] > 0, int(settings[0])
    # Intervals after which the forcing repeats; 0 if it never does.
    cycle = int(settings[1]) if forced else 1
    h = interval / steps
    begun = np.zeros((2, lanes))
    block, table, normals = pointer_to(z), pointer_to(tabulated), pointer_to(drawn)
    theta = offset_by(pointer_to(parameters), int(parameters[0]))
    waiting, active, elapsed, step, used = place[0], place[1], place[2], place[3], 0
    if elapsed < 0:  # the first call
        elapsed = 0
        if forced:
            for phase in range(cycle):
                tabulate(start_time + phase * interval, h, steps, theta, offset_by(table, phase * steps * nodes))
    while used < most and (waiting < count or active > 0):
        # If the forcing never repeats, lanes that do not share the phase of a newcomer go on first.
        if step == 0 and (active == 0 or cycle > 0):
            if active == 0:
                elapsed = phases[waiting]
            for lane in range(lanes):
                while holder[lane] < 0 and waiting < count:
                    ahead = elapsed - phases[waiting]
                    if budget[waiting] > 0:
                        if ahead != 0 and (cycle == 0 or ahead % cycle != 0):
                            break
                        holder[lane] = waiting
                        done[lane] = 0
                        active += 1
                        if noisy:
                            for k in range(4):
                                stream[k, lane] = streams[waiting, k]
                        for e in range(equations):
                            z[e, lane] = states[waiting, e]
                    else:
                        for e in range(equations):
                            out_states[waiting, e] = states[waiting, e]
                        out_intervals[waiting] = 0
                        out_status[waiting] = COMPLETED
                        out_label[waiting] = -1
                    waiting += 1
            if active == 0:
                break
        if step == 0:
            if cycle == 0:
                tabulate(start_time + elapsed * interval, h, steps, theta, table)
            for lane in range(lanes):
                outside[lane] = False
                for e in range(equations):
                    before[e, lane] = z[e, lane]
        forces = offset_by(table, ((elapsed % cycle if cycle > 0 else 0) * steps + step) * nodes)
        end = min(step + MOST_STEPS, steps)
        used += end - step
        at_once = 1 if noisy or between else end - step
        for now in range(step, end, at_once):
            if noisy:
                draw_lanes(stream, drawn, lanes)
                if given.shape[0] > 0:
                    drawn[0] = given[done[0] * steps + now, 0]
                    drawn[lanes] = given[done[0] * steps + now, 1]
            if between:
                for lane in range(lanes):
                    begun[0, lane], begun[1, lane] = z[0, lane], z[1, lane]
            step_lanes(block, forces, normals, theta, h, at_once)
            if between:
                for lane in range(lanes):
                    x, v = z[0, lane], z[1, lane]
                    outside[lane] |= left_in_step(begun[0, lane], begun[1, lane], x, v, h, region)
            forces = offset_by(forces, nodes)
        step = end if end < steps else 0
        if step > 0:
            continue
        elapsed += 1
        for lane in range(lanes):
            index = holder[lane]
            if index < 0:
                continue
            finite = True
            for e in range(equations):
                finite = finite and np.isfinite(z[e, lane])
            label = -1
            if not finite:
                status = DIVERGED
            else:
                done[lane] += 1
                passed = phases[index] + done[lane]
                at_section = passed % every == 0
                if visits.shape[1] > 0 and passed % keep == 0:
                    visit = (passed // keep - phases[index] // keep - 1) % visits.shape[1]
                    for e in range(equations):
                        visits[index, visit, e] = z[e, lane]
                x, v = z[0, lane], z[1, lane]
                status, label = stop_status(
                    x, v, at_section, region, area, labels, home, points, point_labels, metrics, turn
                )
                if status == COMPLETED and outside[lane]:
                    status = LEFT_REGION
                if status == COMPLETED and done[lane] < budget[index]:
                    continue
            for e in range(equations):
                out_states[index, e] = z[e, lane] if finite else before[e, lane]
                z[e, lane] = 0.0
            if noisy:
                for k in range(4):
                    streams[index, k] = stream[k, lane]
            out_intervals[index] = done[lane]
            out_status[index] = status
            out_label[index] = label
            holder[lane] = -1
            active -= 1
    place[0], place[1], place[2], place[3] = waiting, active, elapsed, step
    return used
