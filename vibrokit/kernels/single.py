"""Runs one trajectory, or some, and keeps all samples."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibrokit.kernels.choice import warn_of_coarse_steps
from vibrokit.kernels.ensemble import Stop, advance_block, common_of, compiled_kernel
from vibrokit.kernels.kernel import kernel_for
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.streams import streams_of
from vibrokit.parts.scene import Scene
from vibrokit.symbolic.flow_kind import Flow


def record(
    scene: Scene,
    flow: Flow,
    stepper: Stepper,
    state: NDArray[np.float64],  # (equations,), in the layout of the flow
    start_time: float,
    spacing: float,  # time from sample to sample (s)
    count: int,  # samples after the start
    *,
    normals: NDArray[np.float64] | None = None,  # (steps, 2), in place of those drawn, for coupled paths
) -> NDArray[np.float64]:
    """Integrate one trajectory of any flow; return its samples (≤ count + 1, equations).

    They are fewer if the trajectory diverged, needed too many steps, or grazed a stop whose force jumps.
    """
    return recorded(scene, flow, stepper, state, start_time, spacing, count, normals=normals)[0]


def recorded(
    scene: Scene,
    flow: Flow,
    stepper: Stepper,
    state: NDArray[np.float64],
    start_time: float,
    spacing: float,
    count: int,
    *,
    seed: int | None = None,  # of the noise, for the noisy flow
    normals: NDArray[np.float64] | None = None,
) -> tuple[NDArray[np.float64], int]:
    """Return what `record` does, and why the trajectory ended: a constant of `vibrokit.kernels.stopping`."""
    kernel = kernel_for(scene, flow, stepper)
    warn_of_coarse_steps(scene, flow, stepper)
    common = common_of(scene, stepper, start_time, spacing, count)
    streams = streams_of(seed or 0, np.zeros(1, dtype=np.int64)) if flow is Flow.NOISY else np.empty((1, 0), np.uint64)
    budget, phase = np.full(1, count), np.zeros(1, dtype=np.int64)
    path = advance_block(kernel, state[None], budget, common, streams, phase, Stop(), count, 1, normals)
    return np.concatenate([state[None], path.visits[0, : path.intervals[0]]]), int(path.status[0])


def record_each(
    scene: Scene,
    flow: Flow,
    stepper: Stepper,
    states: NDArray[np.float64],  # (trajectories, equations)
    phases: NDArray[np.intp],  # (trajectories,): starts, in spacings since the section
    spacing: float,  # time from sample to sample (s)
    count: int,  # samples after the start
) -> NDArray[np.float64]:
    """Integrate some trajectories of a noise-free flow; return their samples (trajectories, count + 1, equations).

    Those of one phase are integrated together. Samples of a trajectory that ended early are NaN from there on.
    """
    kernel = compiled_kernel(scene, flow, stepper)
    warn_of_coarse_steps(scene, flow, stepper)
    order = np.argsort(phases, kind="stable")
    common = common_of(scene, stepper, 0.0, spacing, count)
    none, budget = np.empty((len(states), 0), dtype=np.uint64), np.full(len(states), count)
    ended = advance_block(kernel, states[order], budget, common, none, phases[order], Stop(), count, 1)
    ended.visits[np.arange(count) >= ended.intervals[:, None]] = np.nan
    samples = np.empty((len(states), count + 1, states.shape[1]))
    samples[:, 0], samples[order, 1:] = states, ended.visits
    return samples
