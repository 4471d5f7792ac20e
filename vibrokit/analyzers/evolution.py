"""How a distribution of states changes in time."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.metastability import nearest
from vibrokit.analyzers.sgcm.density_flow import DensityFlow, check_memory, check_steps, steps_for
from vibrokit.analyzers.sgcm.density_grid import DensityGrid, checked_nodes, resolved
from vibrokit.analyzers.sgcm.propagator import Propagator, checked_noise
from vibrokit.arguments import members, real
from vibrokit.construction import called
from vibrokit.errors import StructureError, shown
from vibrokit.kernels.choice import ensemble_stepper
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.progress import Progress, advance, stage, working
from vibrokit.results.attractor import Attractor
from vibrokit.results.codes import Code
from vibrokit.results.density_history import DensityHistory
from vibrokit.results.finding import Finding
from vibrokit.results.region import Region
from vibrokit.results.stoppable import Stoppable
from vibrokit.scene_file import scene_data
from vibrokit.structure.validation import check_means, gibibytes, plain
from vibrokit.symbolic.flow_kind import Flow

_DEPTH = 60.0  # in ln ρ below the maximum that is resolved

Array = NDArray[np.float64]


@called
def evolve_density(
    osc: Oscillator,
    region: Any,
    intervals: Sequence[float] = (1, 5, 20),
    *,
    start: Any = None,
    phase: float = 0.0,
    nodes: tuple[int, int] = (240, 240),
    steps: int | None = None,
    max_memory_gib: float = 2.0,
    stepper: Stepper | None = None,
    executor: Executor | None = None,
    progress: Progress = None,
    time_limit: float | None = None,
) -> DensityHistory:
    """Compute the probability density of the state at some times.

    ln ρ is carried along the exact flow and diffuses in closed form, as in `SGCM`.

    Parameters
    ----------
    osc : Oscillator
        With noise that has no states of its own.
    region : ((float, float), (float, float))
        Bounds of x and v. What leaves them is lost, and `DensityHistory.mass` shows how much.
    intervals : sequence of float
        Times, in section intervals since the start.
    start : array_like (2,) or (2, 2), or Attractor, optional
        A state, about which the start is a normal distribution with a standard deviation of 1.5 node spacings; the
        points of an attractor, about each of which it is the same; or bounds of x and v, between which the start is
        uniform; by default those of the region.
    phase : float
        When it starts, in section intervals since a section, from 0 to 1.
    nodes : (int, int)
        Nodes in x and in v.
    steps : int, optional
        How often noise acts in a section interval; even. By default 2 per radian of the fastest oscillation or decay.
    max_memory_gib : float
        Memory that the flow between the nodes may take (GiB).
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
    noise, shape, wanted = checked_noise(osc), checked_nodes("evolve_density", nodes), _checked_times(intervals)
    area, begins = Region.of(region), _checked_phase(phase)
    flow = _flow(osc, DensityGrid.of(osc, area, shape), steps, max_memory_gib, stepper)
    propagator, grid = Propagator(flow, noise.intensity, executor), flow.grid
    begun, reached = _start(grid, start), list[tuple[Array, float]]()
    with working(progress, time_limit) as work:
        with Stoppable("evolve_density") as walk:
            for one in _at([begins + time for time in wanted], begins, propagator, begun):
                reached.append(one)
        times = np.array(wanted[: len(reached)]) * osc.section_interval
        masses = [math.exp(grid.mass(phi)) for phi, _ in reached]
        origin = start.points[:, :2].tolist() if isinstance(start, Attractor) else start
        arguments = {"region": area, "intervals": wanted, "start": origin, "phase": phase, "nodes": shape}
        return DensityHistory(
            times=times,
            x=grid.x,
            v=grid.v,
            log_density=np.array([resolved(phi) for phi, _ in reached]).reshape(-1, *shape),
            mass=np.array(masses),
            scene=scene_data(osc),
            settings=plain(arguments | {"steps": flow.steps, "stepper": stepper}),
            findings=(*walk.findings, *_findings(times, masses, [change for _, change in reached])),
            stats=work.stats,
            complete=len(reached) == len(wanted),
            seconds=work.seconds,
        )


def _flow(
    osc: Oscillator, grid: DensityGrid, steps: int | None, max_memory_gib: float, stepper: Stepper | None
) -> DensityFlow:
    """The flow on a grid; raises StructureError if noise cannot act so often, or if that needs too much memory."""
    count = steps_for(osc, grid.nodes.reshape(-1, 2)) if steps is None else steps
    check_steps("evolve_density", count)
    check_memory(osc, grid.shape, count, gibibytes("evolve_density: max_memory_gib", max_memory_gib))
    return DensityFlow(osc, stepper or ensemble_stepper(osc, Flow.STATE_VARIATIONAL), grid, count)


def _at(ends: list[float], now: float, propagator: Propagator, phi: Array) -> Iterator[tuple[Array, float]]:
    """Yield ln ρ at some times, in section intervals, and ln of what truncation has changed in its probability."""
    flow, change, same = propagator.flow, 0.0, 1e-9  # times that differ by less are equal
    interval, floor = flow.scene.section_interval, float(phi.max()) - _DEPTH
    with stage("density", unit="section intervals", total=math.ceil(ends[-1])):
        for end in ends:
            while now < end - same:
                section = math.floor(now + same)
                until = min(section + 1.0, end)
                whole_interval = now < section + same and until > section + 1 - same
                legs = flow.legs if whole_interval else flow.between(*(interval * (t - section) for t in (now, until)))
                phi, added = propagator.along(legs, phi, floor)
                lower = float(phi.max()) - _DEPTH
                phi, floor = np.where(phi <= floor, lower, phi), lower  # what is at the floor is not computed
                change, now = change + added, until
                advance()
            yield phi, change


def _findings(times: Array, masses: list[float], changes: list[float]) -> list[Finding]:
    """What was lost over the edge, and what truncation would have changed, where either is largest and above 1 %."""
    found = [
        Finding.of(Code.MASS_NOT_KEPT, time=float(time), mass=mass)
        for time, mass in zip(times, masses, strict=True)
        if abs(mass - 1) > 0.01
    ][-1:]
    if changes and max(map(abs, changes)) > 0.01:
        worst = int(np.argmax(np.abs(changes)))
        found.append(Finding.of(Code.DENSITY_TRUNCATED, time=float(times[worst]), change=math.expm1(changes[worst])))
    return found


def _checked_phase(phase: object) -> float:
    if not 0 <= real(phase) < 1:
        raise StructureError(f"evolve_density: phase must be a number from 0 to below 1, got {shown(phase)}.")
    return real(phase)


def _checked_times(intervals: Sequence[float]) -> tuple[float, ...]:
    found = members(intervals)
    given = (intervals,) if found is None else found
    for time in given:
        if not 0 < real(time) <= 100_000:
            raise StructureError(
                f"evolve_density: intervals must be numbers above 0 and up to 100000, got {shown(time)}."
            )
    if not given or list(given) != sorted(set(given)):
        raise StructureError(f"evolve_density: intervals must be one or more in ascending order, got {shown(given)}.")
    return tuple(real(time) for time in given)


def _start(grid: DensityGrid, start: Any) -> Array:
    """ln ρ at the start, of probability 1."""
    if isinstance(start, Attractor):
        corners, box = start.points[:, :2], None
    else:
        given = _numbers(grid.region.bounds if start is None else start)
        box = given if given.shape == (2, 2) and bool(np.all(given[:, 0] < given[:, 1])) else None
        corners = box.T if box is not None else given[None] if given.shape == (2,) else np.full((1, 2), np.nan)
    if not grid.region.contains(corners).all():
        raise StructureError(
            "evolve_density: start must be a state (x, v), an Attractor, or bounds ((x, x), (v, v)), inside the region "
            f"x {grid.region.x}, v {grid.region.v}, got {shown(start)}."
        )
    if box is not None:
        inside = ((grid.nodes >= box[:, 0]) & (grid.nodes <= box[:, 1])).all(axis=-1)
        if not inside.any():
            raise StructureError(
                f"evolve_density: start {shown(start)} contains no node of {grid.shape}; widen it, or raise nodes."
            )
        phi = np.where(inside, 0.0, -_DEPTH)
    else:
        roots = np.eye(2) / (1.5 * grid.local_spacing(corners))[:, None, :]
        phi = -0.5 * nearest(grid.nodes, corners, roots)
    return phi - grid.mass(phi)


def _numbers(start: Any) -> Array:
    """The start as an array of numbers; an empty array if it does not consist of numbers."""
    try:
        return np.asarray(start, dtype=float)
    except (TypeError, ValueError, OverflowError):
        return np.empty(0)
