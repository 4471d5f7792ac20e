"""Classical Runge–Kutta with fixed steps, trajectories packed in lanes.

All lanes of a block share the phase of the forcing, so it is tabulated once. A lane whose trajectory has ended is
given the next one at the following section.
"""

import numpy as np
from numba import njit

from vibrokit.kernels.stopping import NOT_FINITE, RAN_OUT, section_status
from vibrokit.kernels.templates.scene import EQUATIONS, LANES, OPTIONS, slopes, step_lanes, tabulate

# --- scene above, stepper below ---


@njit(**OPTIONS)
def advance(
    states,
    theta,
    start_time,
    interval,
    settings,
    budget,
    region,
    labels,
    home,
    points,
    point_labels,
    tolerance,
    out_states,
    out_intervals,
    out_status,
    out_label,
):
    steps = int(settings[0])
    repeats = settings[1] != 0.0
    h = interval / steps
    count = states.shape[0]
    table = np.zeros(2 * steps + 1)  # forced
    z = np.zeros((EQUATIONS, LANES))
    before = np.zeros((EQUATIONS, LANES))
    holder = np.full(LANES, -1, dtype=np.int64)
    done = np.zeros(LANES, dtype=np.int64)
    waiting = 0
    active = 0
    elapsed = 0
    tabulate(start_time, h, theta, table)  # forced
    while waiting < count or active > 0:
        # Lanes that do not share the phase of a newcomer must finish first.
        if active == 0 or repeats:
            for lane in range(LANES):
                while holder[lane] < 0 and waiting < count:
                    if budget[waiting] > 0:
                        holder[lane] = waiting
                        done[lane] = 0
                        active += 1
                        for e in range(EQUATIONS):
                            z[e, lane] = states[waiting, e]
                    else:
                        out_states[waiting] = states[waiting]
                        out_intervals[waiting] = 0
                        out_status[waiting] = RAN_OUT
                        out_label[waiting] = -1
                    waiting += 1
            elapsed = 0
            if active == 0:
                break
        if not repeats:  # forced
            tabulate(start_time + elapsed * interval, h, theta, table)  # forced
        before[:, :] = z
        for step in range(steps):
            step_lanes(z, table[2 * step], table[2 * step + 1], table[2 * step + 2], theta, h)  # forced
            step_lanes(z, theta, h)  # unforced
        elapsed += 1
        for lane in range(LANES):
            index = holder[lane]
            if index < 0:
                continue
            finite = True
            for e in range(EQUATIONS):
                finite = finite and np.isfinite(z[e, lane])
            label = -1
            if not finite:
                status = NOT_FINITE
            else:
                done[lane] += 1
                status, label = section_status(
                    z[0, lane], z[1, lane], region, labels, home, points, point_labels, tolerance
                )
                if status == RAN_OUT and done[lane] < budget[index]:
                    continue
            for e in range(EQUATIONS):
                out_states[index, e] = z[e, lane] if finite else before[e, lane]
                z[e, lane] = 0.0
            out_intervals[index] = done[lane]
            out_status[index] = status
            out_label[index] = label
            holder[lane] = -1
            active -= 1


@njit(**OPTIONS)
def record(state, theta, start_time, spacing, settings, out):
    steps = max(1, int(np.ceil(spacing / settings[2] - 1e-9)))
    h = spacing / steps
    z = state.copy()
    point = np.empty(EQUATIONS)
    k1 = np.empty(EQUATIONS)
    k2 = np.empty(EQUATIONS)
    k3 = np.empty(EQUATIONS)
    k4 = np.empty(EQUATIONS)
    out[0] = z
    for sample in range(1, out.shape[0]):
        for step in range(steps):
            t = start_time + (sample - 1) * spacing + step * h
            slopes(t, z, theta, k1)
            for e in range(EQUATIONS):
                point[e] = z[e] + 0.5 * h * k1[e]
            slopes(t + 0.5 * h, point, theta, k2)
            for e in range(EQUATIONS):
                point[e] = z[e] + 0.5 * h * k2[e]
            slopes(t + 0.5 * h, point, theta, k3)
            for e in range(EQUATIONS):
                point[e] = z[e] + h * k3[e]
            slopes(t + h, point, theta, k4)
            for e in range(EQUATIONS):
                z[e] += h / 6.0 * (k1[e] + 2.0 * (k2[e] + k3[e]) + k4[e])
        for e in range(EQUATIONS):
            if not np.isfinite(z[e]):
                return sample
        out[sample] = z
    return out.shape[0]
