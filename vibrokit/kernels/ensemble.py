"""Runs many trajectories, split into blocks that threads or any executor integrate."""

from __future__ import annotations

import concurrent.futures as futures
import contextlib
import dataclasses
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrokit.kernels.choice import warn_of_coarse_steps
from vibrokit.kernels.kernel import Kernel, kernel_for, theta_of
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.stopping import DIVERGED, STALLED
from vibrokit.kernels.tasks import carry, processors
from vibrokit.parts.scene import Scene
from vibrokit.progress import TRAJECTORIES, advance, count
from vibrokit.symbolic.flow_kind import Flow

_BLOCK = 2048
_SMALLEST_BLOCK, _MANY_INTERVALS = 64, 16  # half as many for that many intervals, each worth more than handing over

Array = NDArray[Any]

UNBOUNDED = np.array([[-np.inf, np.inf], [-np.inf, np.inf]])
"""Bounds of x and of v that no state exceeds."""


@dataclasses.dataclass(frozen=True, eq=False)
class Stop:
    r"""When a trajectory ends before its budget, tested in the kernel after every interval.

    Attributes
    ----------
    region : array (2, 2)
        Bounds of x and of v; a trajectory outside has left the region.
    between : bool
        Whether the bounds hold between two tests too: after each fixed step, and for x within it, where a cubic
        through both ends decides. Steppers without fixed steps have the cubic through both tests.
    every : int
        Intervals from section to section: labels and points are tested on the section only.
    area : array (2, 2), labels : int16 array (nx, nv)
        Bounds of a grid of cells, and the labels of the cells; one that is neither negative nor `home` ends the
        trajectory.
    home : int
    points : array (m, 2), point_labels : int64 array (m,), metrics : array (m, 2, 2)
        Known points of the section; a trajectory has reached c if it is at q with R (q − c) has a length of 1 or less.
    turn : float
        Distance along x at which cells and points repeat, as on a circle; 0 where they do not.
    """

    region: Array = dataclasses.field(default_factory=UNBOUNDED.copy)
    between: bool = False
    every: int = 1
    area: Array = dataclasses.field(default_factory=UNBOUNDED.copy)
    labels: Array = dataclasses.field(default_factory=lambda: np.empty((0, 0), dtype=np.int16))
    home: int = -1
    points: Array = dataclasses.field(default_factory=lambda: np.empty((0, 2)))
    point_labels: Array = dataclasses.field(default_factory=lambda: np.empty(0, dtype=np.int64))
    metrics: Array = dataclasses.field(default_factory=lambda: np.empty((0, 2, 2)))
    turn: float = 0.0

    def with_cells(self, bounds: Array, labels: Array, home: int = -1) -> Stop:
        """Return this test, also in the cells of a grid, outside of which a trajectory has left the region."""
        return dataclasses.replace(self.or_in_cells(bounds, labels), region=bounds, home=home)

    def or_in_cells(self, bounds: Array, labels: Array) -> Stop:
        """Return this test, also in the cells of a grid; outside of them motion goes on."""
        return dataclasses.replace(self, area=bounds, labels=labels)

    def unpacked(self) -> tuple[Any, ...]:
        """Return what drivers read, as they unpack it.

        Handed on as a whole, the references to its arrays would be counted at each test, with which RK4 took a tenth
        longer on ``hertz-0.570``.
        """
        cells = _plain(self.area, float), _plain(self.labels, np.int16), self.home
        points = _plain(self.points, float), _plain(self.point_labels, np.int64), _plain(self.metrics, float)
        return self.every, _plain(self.region, float), self.between, *cells, *points, float(self.turn)


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
    visits : array (count, visits, equations)
        The latest states that were kept: the n-th is in row (n − 1) mod `visits`.
    streams : uint64 array (count, 4)
        States of the random streams at the end; empty without noise.
    """

    states: Array
    intervals: Array
    status: Array
    label: Array
    visits: Array
    streams: Array


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
    streams: Array | None = None,
    phases: int | Array = 0,
    visits: int = 0,
    keep: int = 1,
    executor: futures.Executor | None = None,
) -> Ensemble:
    """Advance trajectories interval by interval until each meets a stop test or has spent its budget.

    One that goes on from the states and streams of an ensemble gets the same bits as one that never paused.
    Trajectories, intervals and steps count into the work under way; a stage of trajectories advances by each block.

    Parameters
    ----------
    states : array (count, equations)
        Starts, in the layout of the flow; ValueError if they have another.
    budget : int or array (count,)
        Most intervals to take.
    stop : Stop, optional
    start_time : float
        Time of the start (s).
    interval : float, optional
        Time from section to section (s); the scene's own by default.
    streams : uint64 array (count, 4), optional
        For the noisy flow: the state of each trajectory's own random stream, as `vibrokit.kernels.streams.streams_of`
        starts it, or as an ensemble ended.
    phases : int or array (count,)
        Intervals from `start_time` to the start of each trajectory.
    visits, keep : int
        How many states to keep of each trajectory, the latest; one every `keep` intervals from `start_time`.
    executor : concurrent.futures.Executor, optional
        Integrates the blocks; threads of this process by default. The result is the same to the last bit.
    """
    kernel = compiled_kernel(scene, flow, stepper)
    warn_of_coarse_steps(scene, flow, stepper)
    starts, equations = np.ascontiguousarray(states, dtype=float), kernel.module.EQUATIONS
    if starts.ndim != 2 or starts.shape[1] != equations:  # a kernel would read and write beyond the array
        raise ValueError(f"states of the {flow.value} flow have shape (count, {equations}), got {starts.shape}.")
    budgets, begun = (np.broadcast_to(numbers, len(starts)) for numbers in (budget, phases))
    span = scene.section_interval if interval is None else interval
    common = common_of(scene, stepper, start_time, span)
    known = np.empty((len(starts), 0), dtype=np.uint64) if streams is None else streams
    tasks = [
        (kernel, starts[block], budgets[block], common, known[block], begun[block], stop or Stop(), visits, keep)
        for block in _blocks(len(starts), int(np.max(budgets, initial=0)))
    ]
    steps, parts = stepper.steps_in(scene, span), []
    with contextlib.closing(carry(advance_block, tasks, executor)) as blocks:
        for part in blocks:
            parts.append(part)
            passed = int(part.intervals.sum())
            count(trajectories=len(part.intervals), intervals=passed, steps=steps * passed)
            advance(len(part.intervals), TRAJECTORIES)
    names = [field.name for field in dataclasses.fields(Ensemble)]
    return Ensemble(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


def common_of(scene: Scene, stepper: Stepper, start_time: float, interval: float, samples: int = 0) -> tuple[Any, ...]:
    """Return what all trajectories of a block share: parameters, start time, interval and settings of the stepper."""
    return theta_of(scene), start_time, interval, np.array(stepper.settings(scene, interval, samples))


def compiled_kernel(scene: Scene, flow: Flow, stepper: Stepper) -> Kernel:
    """Return the kernel of an ensemble, compiled here rather than in several threads at once; marked as compilation."""
    kernel = kernel_for(scene, flow, stepper)
    if not kernel.link():
        nothing, none = np.empty((0, kernel.module.EQUATIONS)), np.empty(0, dtype=np.int64)
        streams = np.empty((0, 4 if flow is Flow.NOISY else 0), dtype=np.uint64)
        advance_block(kernel, nothing, none, common_of(scene, stepper, 0.0, 1.0), streams, none, Stop(), 0, 1)
    return kernel


def _blocks(count: int, intervals: int) -> Iterator[slice]:
    smallest = _SMALLEST_BLOCK // (2 if intervals >= _MANY_INTERVALS else 1)
    size = min(_BLOCK, max(smallest, -(-count // (4 * processors()))))
    size = -(-size // smallest) * smallest
    for start in range(0, max(count, 1), size):
        yield slice(start, min(start + size, count))


def advance_block(
    kernel: Kernel,
    starts: Array,
    budget: Array,
    common: tuple[Any, ...],
    streams: Array,
    phases: Array,
    stop: Stop,
    visits: int,
    keep: int,
    normals: Array | None = None,
) -> Ensemble:
    """Advance a block of trajectories; those of noise have streams, and normals may replace what one of them draws."""
    count, equations = starts.shape
    streams = np.array(streams, dtype=np.uint64)  # the kernel advances them in place
    intervals, status, label = (np.zeros(count, dtype=np.int64) for _ in range(3))
    ended = Ensemble(
        np.empty((count, equations)), intervals, status, label, np.zeros((count, visits, equations)), streams
    )
    given = _plain(starts, float), *common, streams, np.empty((0, 2)) if normals is None else _plain(normals, float)
    budgets, begun = _plain(budget, np.int64), _plain(phases, np.int64)
    outputs = ended.states, ended.intervals, ended.status, ended.label, ended.visits
    kernel.advance(*given, budgets, begun, keep, stop.unpacked(), outputs)
    if kernel.module.BORDERED:  # next to a pole time does not go on: the motion ends there
        status[status == STALLED] = DIVERGED
    return ended


def _plain(array: Array, kind: type) -> Array:
    """The same numbers, contiguous and writable: Numba would compile again for other arrays."""
    return np.require(array, kind, ("C", "W"))
