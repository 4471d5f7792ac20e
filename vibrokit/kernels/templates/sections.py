"""From section to section, for steppers that locate their events."""

import numpy as np
from numba import njit

from vibrokit.kernels.stopping import COMPLETED, DIVERGED, LEFT_REGION, stop_status, turned_outside
from vibrokit.kernels.templates.located import press
from vibrokit.kernels.templates.order8 import fly
from vibrokit.kernels.templates.scene import BARRIERS, EQUATIONS, OPTIONS
from vibrokit.kernels.templates.settling import settle
from vibrokit.kernels.templates.steps import (
    CLOCK,
    CONTACT_STEP,
    COUNT,
    FIRST_STEP,
    FREE_STEP,
    INNER,
    MEMORY,
    ROWS,
    SPAN,
    SPARE,
    TIMED,
    TOUCHED,
)

# --- scene above, stepper below ---


@njit(**INNER)
def copy_state(source, target):
    for e in range(EQUATIONS):
        target[e] = source[e]


@njit(**INNER)
def begin(y, interval, memory, pushing, theta, workspace):
    """Reset the memory, so that the motion depends on y alone."""
    memory[SPAN] = abs(interval)
    memory[FREE_STEP] = interval / 16.0
    memory[FIRST_STEP] = interval / 128.0
    memory[CONTACT_STEP] = memory[FIRST_STEP]
    if BARRIERS > 0:
        settle(y, memory, pushing, theta, workspace[SPARE])
    else:
        memory[TOUCHED] = -1.0


@njit(**INNER)
def travel(y, end, memory, pushing, theta, settings, workspace, coefficients):
    """Integrate y to the time `end`, from contact to contact."""
    memory[COUNT], memory[TIMED] = 0.0, 0.0
    status = COMPLETED
    while y[CLOCK] < end and status == COMPLETED:
        if BARRIERS > 0 and memory[TOUCHED] >= 0.0:
            status = press(y, end, memory, pushing, theta, settings, workspace)
        else:
            status = fly(y, end, memory, pushing, theta, settings, workspace, coefficients)
    for e in range(EQUATIONS):
        if not np.isfinite(y[e]):
            return DIVERGED
    return status


@njit(**OPTIONS)
def advance(
    states,
    theta,
    start_time,
    interval,
    settings,
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
    memory, pushing = np.zeros(MEMORY), np.zeros(max(BARRIERS, 1), dtype=np.bool_)
    workspace, coefficients, y = workspaces()
    cycle = int(settings[2])  # intervals after which the forcing repeats; 0 if it never does
    for index in range(states.shape[0]):
        status, label, done = COMPLETED, -1, 0
        copy_state(states[index], out_states[index])
        while status == COMPLETED and done < budget[index]:
            # Where the forcing repeats, so do the times: the phase cannot drift.
            passed = phases[index] + done
            start = start_time + (passed % cycle if cycle > 0 else passed) * interval
            copy_state(out_states[index], y)
            x, v = y[0], y[1]
            y[CLOCK] = start
            begin(y, interval, memory, pushing, theta, workspace)
            status = travel(y, start + interval, memory, pushing, theta, settings, workspace, coefficients)
            if status == COMPLETED:
                done += 1
                passed += 1
                copy_state(y, out_states[index])
                at_section = passed % every == 0
                if visits.shape[1] > 0 and passed % keep == 0:
                    visit = (passed // keep - phases[index] // keep - 1) % visits.shape[1]
                    copy_state(y, visits[index, visit])
                status, label = stop_status(
                    y[0], y[1], at_section, region, area, labels, home, points, point_labels, metrics
                )
                if between and status == COMPLETED and turned_outside(x, v, y[0], y[1], interval, region):
                    status = LEFT_REGION
        out_intervals[index], out_status[index], out_label[index] = done, status, label


@njit(**INNER)
def workspaces():
    return np.zeros((ROWS, CLOCK + 1)), np.zeros((EQUATIONS, 32)), np.zeros(CLOCK + 1)


@njit(**OPTIONS)
def record(state, theta, start_time, spacing, settings, out):
    memory, pushing = np.zeros(MEMORY), np.zeros(max(BARRIERS, 1), dtype=np.bool_)
    workspace, coefficients, y = workspaces()
    copy_state(state, out[0])
    copy_state(state, y)
    y[CLOCK] = start_time
    begin(y, spacing * (out.shape[0] - 1), memory, pushing, theta, workspace)
    for sample in range(1, out.shape[0]):
        status = travel(y, start_time + sample * spacing, memory, pushing, theta, settings, workspace, coefficients)
        if status != COMPLETED:
            return sample
        copy_state(y, out[sample])
    return out.shape[0]
