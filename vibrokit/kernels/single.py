"""Runs one trajectory and keeps all its samples."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibrokit.kernels.choice import warn_of_coarse_steps
from vibrokit.kernels.ensemble import Stop, advance_block
from vibrokit.kernels.kernel import kernel_for, theta_of
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
    seed: int | None = None,  # of the noise, for the noisy flow
    normals: NDArray[np.float64] | None = None,  # (steps, 2), in place of those drawn, for coupled paths
) -> NDArray[np.float64]:
    """Integrate one trajectory of any flow; return its samples (≤ count + 1, equations).

    They are fewer if the trajectory diverged, needed too many steps, or grazed a stop whose force jumps.
    """
    kernel = kernel_for(scene, flow, stepper)
    warn_of_coarse_steps(scene, flow, stepper)
    common = (theta_of(scene), start_time, spacing, np.array(stepper.settings_of_path(scene, spacing, count)))
    streams = streams_of(seed or 0, np.zeros(1, dtype=np.int64)) if flow is Flow.NOISY else np.empty((1, 0), np.uint64)
    budget, phase = np.full(1, count), np.zeros(1, dtype=np.int64)
    path = advance_block(kernel, state[None], budget, common, streams, phase, Stop(), count, 1, normals)
    return np.concatenate([state[None], path.visits[0, : path.intervals[0]]])
