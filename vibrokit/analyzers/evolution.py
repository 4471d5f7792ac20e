"""How a distribution of states changes in time."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import ExitStack
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.sgcm.density_grid import DensityGrid, checked_nodes, resolved
from vibrokit.analyzers.sgcm.propagator import MOST_STEPS, FlowTables, Propagator, checked_noise, steps_for
from vibrokit.errors import StructureError, shown
from vibrokit.kernels.choice import ensemble_stepper
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.progress import Progress, advance, stage, working
from vibrokit.results.density_history import DensityHistory
from vibrokit.results.finding import Code, Finding
from vibrokit.results.region import Region
from vibrokit.scene_file import scene_data
from vibrokit.structure.validation import check_means, plain, whole
from vibrokit.symbolic.flow_kind import Flow

_DEPTH = 60.0  # in ln p below the maximum that is resolved
_KEPT = 0.01  # change of the probability that a finding reports
_START = 1.5  # standard deviation of a start at one state, in node spacings
_MOST_INTERVALS = 100_000

Array = NDArray[np.float64]


def evolve_density(
    osc: Oscillator,
    region: Any,
    intervals: Sequence[float] = (1, 5, 20),
    *,
    start: Any = None,
    nodes: tuple[int, int] = (240, 240),
    steps: int | None = None,
    stepper: Stepper | None = None,
    executor: Executor | None = None,
    progress: Progress = None,
    time_limit: float | None = None,
) -> DensityHistory:
    """Compute the probability density of the state at some times.

    ln p is carried along the exact flow and diffuses in closed form, as in `SGCM`.

    Parameters
    ----------
    osc : Oscillator
        With noise that has no states of its own.
    region : ((float, float), (float, float))
        Bounds of x and v. What leaves them is lost, and `DensityHistory.mass` shows how much.
    intervals : sequence of float
        Times, in section intervals since the start; each is rounded to a whole number of steps.
    start : array_like (2,) or (2, 2), optional
        A state on the section, about which the start is a normal distribution with a standard deviation of 1.5 node
        spacings; or bounds of x and v, between which the start is uniform; by default those of the region.
    nodes : (int, int)
        Nodes in x and in v.
    steps : int, optional
        Steps of time in a section interval; by default 1.5 per radian of the fastest oscillation or decay.
    stepper : Stepper, optional
    executor : concurrent.futures.Executor, optional
        Threads of this process by default; the result is the same to the last bit.
    progress, time_limit
        As in `find_structure`. If the work is stopped, the times that were reached are returned, marked incomplete.

    Returns
    -------
    DensityHistory

    Raises
    ------
    SceneError
        The scene has no noise, or noise with states of its own.
    StructureError
        An argument has a value that is not allowed, or the start is outside the region.
    """
    check_means(osc, stepper, executor)
    noise = checked_noise(osc)
    shape = checked_nodes("evolve_density", nodes)
    wanted = _checked_times(intervals)
    area = Region.of(region)
    grid = DensityGrid.of(osc, area, shape)
    count = steps_for(osc, grid.nodes.reshape(-1, 2)) if steps is None else steps
    whole("evolve_density: steps", count, 1, MOST_STEPS)
    begun = _start(grid, start)
    ends = np.maximum(np.rint(np.array(wanted) * count).astype(int), 1)
    kept: list[Array] = []
    masses: list[float] = []
    findings: list[Finding] = []
    with working(progress, time_limit) as work, ExitStack() as stack:
        pool = executor or stack.enter_context(ThreadPoolExecutor(os.cpu_count()))
        try:
            chosen = stepper or ensemble_stepper(osc, Flow.STATE_VARIATIONAL)
            propagator = Propagator(FlowTables.of(osc, chosen, grid, count), noise.intensity, pool)
            for carried in _at(ends.tolist(), propagator, begun):
                kept.append(resolved(carried))
                masses.append(math.exp(grid.mass(carried)))
        except KeyboardInterrupt as stopped:
            findings.append(Finding.stopped("evolve_density", stopped))
        times = ends[: len(kept)] / count * osc.section_interval
        findings += [
            Finding.of(Code.MASS_NOT_KEPT, time=float(time), mass=mass)
            for time, mass in zip(times, masses, strict=True)
            if abs(mass - 1) > _KEPT
        ][-1:]
        arguments = {"region": area, "intervals": wanted, "start": start, "nodes": shape, "steps": count}
        return DensityHistory(
            times=times,
            x=grid.x,
            v=grid.v,
            log_density=np.array(kept).reshape(-1, *shape),
            mass=np.array(masses),
            scene=scene_data(osc),
            settings=plain(arguments | {"stepper": stepper}),
            findings=tuple(findings),
            stats=work.stats,
            complete=len(kept) == len(wanted),
            seconds=work.seconds,
        )


def _at(ends: list[int], propagator: Propagator, phi: Array) -> Iterator[Array]:
    """Yield ln p after some numbers of steps since a section."""
    done, steps = 0, propagator.tables.steps
    with stage("density", unit="steps", total=ends[-1]):
        for end in ends:
            while done < end:
                now = min(end - done, steps - done % steps)
                phi = propagator.over(phi, done % steps, now, float(phi.max()) - _DEPTH)
                done += now
                advance(now)
            yield phi


def _checked_times(intervals: Sequence[float]) -> tuple[float, ...]:
    given = tuple(intervals) if isinstance(intervals, Sequence | np.ndarray) else (intervals,)
    for time in given:
        if isinstance(time, bool) or not isinstance(time, Real) or not 0 < time <= _MOST_INTERVALS:
            raise StructureError(
                f"evolve_density: intervals must be numbers above 0 and up to {_MOST_INTERVALS}, got {shown(time)}."
            )
    if not given or list(given) != sorted(set(given)):
        raise StructureError(f"evolve_density: intervals must be one or more in ascending order, got {shown(given)}.")
    return tuple(float(time) for time in given)


def _start(grid: DensityGrid, start: Any) -> Array:
    """ln p at the start, of probability 1."""
    point = np.asarray(grid.region.bounds if start is None else start, dtype=float)
    whole_box = point.shape == (2, 2) and bool(np.all(point[:, 0] < point[:, 1]))
    corners = point.T if whole_box else point.reshape(-1, 2) if point.shape == (2,) else np.full((1, 2), np.nan)
    if not grid.region.contains(corners).all():
        raise StructureError(
            "evolve_density: start must be a state (x, v) or bounds ((x, x), (v, v)), inside the region x "
            f"{grid.region.x}, v {grid.region.v}, got {shown(start)}."
        )
    if whole_box:
        inside = ((grid.nodes >= point[:, 0]) & (grid.nodes <= point[:, 1])).all(axis=-1)
        phi = np.where(inside, 0.0, -_DEPTH)
    else:
        roots = np.eye(2)[None] / (_START * grid.local_spacing(corners))[:, None, :]
        phi = -0.5 * grid.nearest(corners, roots)
    return phi - grid.mass(phi)
