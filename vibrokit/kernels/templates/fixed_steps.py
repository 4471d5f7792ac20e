"""Runge–Kutta steps of one length, trajectories packed in lanes.

All lanes of a block share the phase of the forcing, so it is tabulated once, for all intervals after which it repeats.
A lane whose trajectory has ended is given the next one as soon as the phase is that of its start.

With noise, a step of length h draws ΔW and ΔZ = ∫W dt exactly and gives them as two kicks, ΔZ/h before a Runge–Kutta
step of the drift and ΔW − ΔZ/h after it, so that the driven state and its integral both receive the right
increments. For additive noise that is weak order 2 in the noise and order 4 in the drift (cf. small-noise methods in
Milstein & Tretyakov, *Stochastic Numerics for Mathematical Physics*); where the amplitude depends on the state that
it drives, Milstein's term makes it strong order 1. `given` normals, if any, replace those that a single trajectory
draws.

Lines marked "forced", "unforced", "noisy" or "noiseless" are kept only for such scenes and flows, and those marked
"prepared" only for steps that share factors.
"""

import numpy as np
from numba import njit

from vibrokit.kernels.links import LINKS, prepare, step_lanes, tabulate
from vibrokit.kernels.options import CONTRACTED
from vibrokit.kernels.pointers import offset_by, pointer_to
from vibrokit.kernels.stopping import COMPLETED, DIVERGED, LEFT_REGION, stop_status, turned_outside
from vibrokit.kernels.templates.drawing import draw_lanes
from vibrokit.kernels.templates.scene import EQUATIONS, LANES, NODES, ROOM

# --- scene above, stepper below ---


@njit(**CONTRACTED)
def advance(
    states,
    parameters,
    start_time,
    interval,
    settings,
    streams,  # noisy
    given,  # noisy
    budget,
    phases,
    every,
    keep,
    region,
    between,
    area,
    labels,
    home,
    points,
    point_labels,
    metrics,
    out_states,
    out_intervals,
    out_status,
    out_label,
    visits,
):
    steps = int(settings[0])
    # Intervals after which the forcing repeats; 0 if it never does.
    cycle = int(settings[1])  # forced
    h = interval / steps
    count = states.shape[0]
    z = np.zeros((EQUATIONS, LANES))
    before = np.zeros((EQUATIONS, LANES))
    work = np.zeros(ROOM)
    theta, lanes, room = offset_by(pointer_to(parameters), LINKS), pointer_to(z), pointer_to(work)
    forces = normals = room  # where a scene or a flow has none
    tabulated = np.zeros(max(cycle, 1) * steps * NODES)  # forced
    table = pointer_to(tabulated)  # forced
    prepare(h, theta, room)  # prepared
    stream = np.zeros((4, LANES), dtype=np.uint64)  # noisy
    drawn = np.zeros(2 * LANES)  # noisy
    normals = pointer_to(drawn)  # noisy
    holder = np.full(LANES, -1, dtype=np.int64)
    done = np.zeros(LANES, dtype=np.int64)
    waiting = 0
    active = 0
    elapsed = 0  # forced
    for phase in range(cycle):  # forced
        tabulate(start_time + phase * interval, h, steps, theta, offset_by(table, phase * steps * NODES))  # forced
    while waiting < count or active > 0:
        # Lanes that do not share the phase of a newcomer go on first.
        refill = True  # unforced
        refill = active == 0 or cycle > 0  # forced
        if refill:
            elapsed = elapsed if active > 0 else phases[waiting]  # forced
            for lane in range(LANES):
                while holder[lane] < 0 and waiting < count:
                    ahead = elapsed - phases[waiting]  # forced
                    if budget[waiting] > 0 and ahead != 0 and (cycle == 0 or ahead % cycle != 0):  # forced
                        break  # forced
                    if budget[waiting] > 0:
                        holder[lane] = waiting
                        done[lane] = 0
                        active += 1
                        for k in range(4):  # noisy
                            stream[k, lane] = streams[waiting, k]  # noisy
                        for e in range(EQUATIONS):
                            z[e, lane] = states[waiting, e]
                    else:
                        out_states[waiting] = states[waiting]
                        out_intervals[waiting] = 0
                        out_status[waiting] = COMPLETED
                        out_label[waiting] = -1
                    waiting += 1
            if active == 0:
                break
        row = elapsed % cycle if cycle > 0 else 0  # forced
        if cycle == 0:  # forced
            tabulate(start_time + elapsed * interval, h, steps, theta, table)  # forced
        before[:, :] = z
        forces = offset_by(table, row * steps * NODES)  # forced
        step_lanes(lanes, forces, normals, theta, room, h, steps)  # noiseless
        for step in range(steps):  # noisy
            draw_lanes(stream, drawn)  # noisy
            if given.shape[0] > 0:  # noisy
                drawn[0] = given[done[0] * steps + step, 0]  # noisy
                drawn[LANES] = given[done[0] * steps + step, 1]  # noisy
            step_lanes(lanes, forces, normals, theta, room, h, 1)  # noisy
            forces = offset_by(forces, NODES)  # noisy
        elapsed += 1  # forced
        for lane in range(LANES):
            index = holder[lane]
            if index < 0:
                continue
            finite = True
            for e in range(EQUATIONS):
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
                    for e in range(EQUATIONS):
                        visits[index, visit, e] = z[e, lane]
                status, label = stop_status(
                    z[0, lane], z[1, lane], at_section, region, area, labels, home, points, point_labels, metrics
                )
                if between and status == COMPLETED:
                    ends = before[0, lane], before[1, lane], z[0, lane], z[1, lane]
                    if turned_outside(ends[0], ends[1], ends[2], ends[3], interval, region):
                        status = LEFT_REGION
                if status == COMPLETED and done[lane] < budget[index]:
                    continue
            for e in range(EQUATIONS):
                out_states[index, e] = z[e, lane] if finite else before[e, lane]
                z[e, lane] = 0.0
            for k in range(4):  # noisy
                streams[index, k] = stream[k, lane]  # noisy
            out_intervals[index] = done[lane]
            out_status[index] = status
            out_label[index] = label
            holder[lane] = -1
            active -= 1
    # Numba frees an array after its last use, which must not be before that of the pointers to it.
    work[0] = 0.0
    tabulated[0] = 0.0  # forced
    drawn[0] = 0.0  # noisy
