"""Runs many trajectories: splits them into blocks and has threads, or any executor, carry the blocks."""

from __future__ import annotations

import concurrent.futures as futures
import dataclasses
import os
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrokit.kernels.choice import warn_of_coarse_steps
from vibrokit.kernels.kernel import Kernel, kernel_for, theta_of
from vibrokit.kernels.stepper import Stepper
from vibrokit.parts.scene import Scene
from vibrokit.symbolic.flow_kind import Flow

_BLOCK = 2048
_SMALLEST_BLOCK = 64

Array = NDArray[Any]
Progress = Callable[[int, int], None]


@dataclasses.dataclass(frozen=True, eq=False)
class Stop:
    """When a trajectory ends before its budget, tested in the kernel at every section.

    Attributes
    ----------
    region : array (2, 2)
        Bounds of x and of v; outside, the trajectory has left.
    labels : int16 array (nx, nv)
        Labels of the cells of the region; a label that is neither negative nor `home` ends the trajectory.
    home : int
    points : array (m, 2), point_labels : int64 array (m,), tolerance : float
        Known places; a trajectory nearer than `tolerance` to one has reached it.
    """

    region: Array = dataclasses.field(default_factory=lambda: np.array([[-np.inf, np.inf], [-np.inf, np.inf]]))
    labels: Array = dataclasses.field(default_factory=lambda: np.empty((0, 0), dtype=np.int16))
    home: int = -1
    points: Array = dataclasses.field(default_factory=lambda: np.empty((0, 2)))
    point_labels: Array = dataclasses.field(default_factory=lambda: np.empty(0, dtype=np.int64))
    tolerance: float = 0.0


@dataclasses.dataclass(frozen=True, eq=False)
class Ensemble:
    """Where trajectories ended.

    Attributes
    ----------
    states : array (count, equations)
        Last state, at a section. Where the numbers ran out of range: the last good one.
    intervals : int64 array (count,)
        Sections passed.
    status : int64 array (count,)
        Why it ended: a constant of `vibrokit.kernels.stopping`.
    label : int64 array (count,)
        Label of the cell or point that ended it; −1 if none did.
    """

    states: Array
    intervals: Array
    status: Array
    label: Array


def run_ensemble(
    scene: Scene,
    flow: Flow,
    stepper: Stepper,
    states: Array,
    budget: int | Array = 1,
    *,
    stop: Stop | None = None,
    start_time: float = 0.0,
    interval: float | None = None,
    stream: tuple[int, int] | None = None,
    executor: futures.Executor | None = None,
    progress: Progress | None = None,
) -> Ensemble:
    """Advance trajectories from section to section until each meets a stop test or has spent its budget.

    Parameters
    ----------
    scene : Scene
    flow : Flow
    stepper : Stepper
    states : array (count, equations)
        Starts, in the layout of the flow.
    budget : int or array (count,)
        Most intervals to take.
    stop : Stop, optional
    start_time : float
        Time of the start (s).
    interval : float, optional
        Time from section to section (s); the scene's own by default.
    stream : (int, int), optional
        For the noisy flow: seed, and index of the first trajectory. Each trajectory has a random stream of its own
        that depends on the seed and its index alone.
    executor : concurrent.futures.Executor, optional
        Carries the blocks; threads of this process by default. The result is the same to the last bit.
    progress : callable, optional
        Called with (blocks done, blocks in all).

    Returns
    -------
    Ensemble
    """
    kernel = kernel_for(scene, flow, stepper)
    warn_of_coarse_steps(scene, flow, stepper)
    starts = np.ascontiguousarray(states, dtype=float)
    budgets = np.broadcast_to(budget, len(starts))
    span = scene.section_interval if interval is None else interval
    common = (theta_of(scene), start_time, span, np.array(stepper.settings(scene, span)))
    tasks = []
    for block in _blocks(len(starts)):
        streams: tuple[Any, ...] = ()
        if stream is not None:
            seed, first = stream
            streams = (np.int64(seed), np.arange(first + block.start, first + block.stop, dtype=np.int64))
        tasks.append((kernel, starts[block], budgets[block], common, streams, stop or Stop()))
    return _joined(list(carry(_advance_block, tasks, executor, progress)), starts.shape[1])


def _blocks(count: int) -> Iterator[slice]:
    workers = os.cpu_count() or 1
    size = min(_BLOCK, max(_SMALLEST_BLOCK, -(-count // (4 * workers))))
    size = -(-size // _SMALLEST_BLOCK) * _SMALLEST_BLOCK
    for start in range(0, count, size):
        yield slice(start, min(start + size, count))


def _advance_block(
    kernel: Kernel, starts: Array, budget: Array, common: tuple[Any, ...], streams: tuple[Any, ...], stop: Stop
) -> Ensemble:
    count = len(starts)
    ended = Ensemble(np.empty_like(starts), *(np.zeros(count, dtype=np.int64) for _ in range(3)))
    starts, region, points = (_plain(array, float) for array in (starts, stop.region, stop.points))
    budget, point_labels = _plain(budget, np.int64), _plain(stop.point_labels, np.int64)
    tests = (region, _plain(stop.labels, np.int16), stop.home, points, point_labels, stop.tolerance)
    outputs = (ended.states, ended.intervals, ended.status, ended.label)
    kernel.module.advance(starts, *common, *streams, budget, *tests, *outputs)
    return ended


def _plain(array: Array, kind: type) -> Array:
    """The same numbers as Numba sees them always: a read-only or strided array would be compiled for anew."""
    return np.require(array, kind, ("C", "W"))


def _joined(parts: list[Ensemble], equations: int) -> Ensemble:
    if not parts:
        return Ensemble(np.empty((0, equations)), *(np.zeros(0, dtype=np.int64) for _ in range(3)))
    names = [field.name for field in dataclasses.fields(Ensemble)]
    return Ensemble(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


def carry(
    work: Callable[..., Any],
    tasks: list[tuple[Any, ...]],
    executor: futures.Executor | None = None,
    progress: Progress | None = None,
) -> Iterator[Any]:
    """Yield ``work(*task)`` for each task, in order; on Ctrl-C nothing more is begun."""
    if executor is None and len(tasks) == 1:  # starting a thread takes longer than most tasks that are alone
        yield work(*tasks[0])
        if progress is not None:
            progress(1, 1)
        return
    pool = executor or futures.ThreadPoolExecutor(max_workers=os.cpu_count())
    pending = [pool.submit(work, *task) for task in tasks]
    try:
        for done, future in enumerate(pending, start=1):
            yield future.result()
            if progress is not None:
                progress(done, len(tasks))
    finally:
        for future in pending:
            future.cancel()
        if executor is None:
            pool.shutdown()
