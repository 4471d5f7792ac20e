"""Runs many trajectories, split into blocks that threads or any executor integrate."""

from __future__ import annotations

import concurrent.futures as futures
import contextlib
import contextvars
import dataclasses
import os
from collections.abc import Callable, Generator, Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrokit.kernels.choice import warn_of_coarse_steps
from vibrokit.kernels.kernel import Kernel, first_call, kernel_for, theta_of
from vibrokit.kernels.stepper import Stepper
from vibrokit.parts.scene import Scene
from vibrokit.progress import TRAJECTORIES, advance, count, working
from vibrokit.symbolic.flow_kind import Flow

_BLOCK = 2048
_SMALLEST_BLOCK = 64

Array = NDArray[Any]

UNBOUNDED = np.array([[-np.inf, np.inf], [-np.inf, np.inf]])
"""Bounds of x and of v that no state exceeds."""


@dataclasses.dataclass(frozen=True, eq=False)
class Stop:
    """When a trajectory ends before its budget, tested in the kernel at every section.

    Attributes
    ----------
    region : array (2, 2)
        Bounds of x and of v; a trajectory outside has left the region.
    labels : int16 array (nx, nv)
        Labels of the cells of the region; a label that is neither negative nor `home` ends the trajectory.
    home : int
    points : array (m, 2), point_labels : int64 array (m,), tolerance : float
        Known points of the section; a trajectory nearer than `tolerance` to one has reached it.
    """

    region: Array = dataclasses.field(default_factory=UNBOUNDED.copy)
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
        Last state, at a section. Of a trajectory that diverged: the last finite one.
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
) -> Ensemble:
    """Advance trajectories from section to section until each meets a stop test or has spent its budget.

    Trajectories, intervals and steps count into the work under way; a stage of trajectories advances by each block.

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
        Integrates the blocks; threads of this process by default. The result is the same to the last bit.

    Returns
    -------
    Ensemble
    """
    kernel = compiled_kernel(scene, flow, stepper)
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
    steps, parts = stepper.steps_in(scene, span), []
    with contextlib.closing(carry(_advance_block, tasks, executor)) as blocks:
        for part in blocks:
            parts.append(part)
            passed = int(part.intervals.sum())
            count(trajectories=len(part.intervals), intervals=passed, steps=steps * passed)
            advance(len(part.intervals), TRAJECTORIES)
    return _joined(parts, starts.shape[1])


def compiled_kernel(scene: Scene, flow: Flow, stepper: Stepper) -> Kernel:
    """Return the kernel of an ensemble, compiled here rather than in several threads at once; marked as compilation."""
    kernel = kernel_for(scene, flow, stepper)
    advance_kernel = kernel.module.advance
    if not advance_kernel.overloads:
        common = (theta_of(scene), 0.0, 1.0, np.array(stepper.settings(scene, 1.0)))
        streams = (np.int64(0), np.empty(0, dtype=np.int64)) if flow is Flow.NOISY else ()
        nothing = np.empty((0, kernel.module.EQUATIONS)), np.empty(0, dtype=np.int64)
        with first_call(advance_kernel):
            _advance_block(kernel, *nothing, common, streams, Stop())
    return kernel


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
    """The same numbers, contiguous and writable: Numba would compile again for other arrays."""
    return np.require(array, kind, ("C", "W"))


def _joined(parts: list[Ensemble], equations: int) -> Ensemble:
    if not parts:
        return Ensemble(np.empty((0, equations)), *(np.zeros(0, dtype=np.int64) for _ in range(3)))
    names = [field.name for field in dataclasses.fields(Ensemble)]
    return Ensemble(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


def carry(
    work: Callable[..., Any], tasks: list[tuple[Any, ...]], executor: futures.Executor | None = None
) -> Generator[Any, None, None]:
    """Yield ``work(*task)`` for each task, in order. Closing the generator starts no more tasks."""
    if executor is None and len(tasks) == 1:  # starting a thread takes longer than most single tasks
        yield work(*tasks[0])
        return
    pool = executor or futures.ThreadPoolExecutor(max_workers=os.cpu_count())
    pending = [pool.submit(_counted_apart, work, task) for task in tasks]
    try:
        for future in pending:
            result, counts = future.result()
            count(**counts)
            yield result
    finally:
        for future in pending:
            future.cancel()
        if executor is None:
            pool.shutdown()


def _counted_apart(work: Callable[..., Any], task: tuple[Any, ...]) -> tuple[Any, Mapping[str, int]]:
    """Do a task, in whatever thread or process; return its result and what it counted."""

    def counted() -> tuple[Any, Mapping[str, int]]:
        with working() as own:
            return work(*task), dict(own.counts)

    return contextvars.Context().run(counted)  # an executor may run it in the calling thread
