"""Finds the steady states of a scene and their basins."""

from __future__ import annotations

import concurrent.futures
import dataclasses
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import StructureError
from vibrokit.kernels.choice import ensemble_stepper, single_stepper
from vibrokit.kernels.ensemble import Progress, run_ensemble
from vibrokit.kernels.single import record
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator, generator_from
from vibrokit.structure.attractor import Attractor
from vibrokit.structure.basins import UNSETTLED, Basins, settle
from vibrokit.structure.orbits import Orbit, refine_orbit
from vibrokit.structure.region import Region
from vibrokit.structure.structure import Structure
from vibrokit.symbolic.flow_kind import Flow

_FOLDS = 30  # e-foldings of the linear damping that a transient is given
_LEAST_WAIT = 200
_LONGEST_WAIT = 20000
_LONGEST_PERIOD = 16
_SAMPLES = 4096
_RECURRENCE = 1e-5
_NEAR = 1e-3  # what a coarse stepper may make of an orbit
_EQUAL = 1e-6
_ROUNDS = 4
_STRENGTHS = ("amplitude", "force")
_MOST_CELLS = 10**9

Array = NDArray[np.float64]


def find_structure(
    osc: Oscillator,
    *,
    region: Any = None,
    cells: tuple[int, int] = (200, 200),
    starts: tuple[int, int] = (24, 24),
    settling: float = 1e-3,
    budget: int | None = None,
    stepper: Stepper | None = None,
    rng: int | np.random.Generator = 0,
    executor: concurrent.futures.Executor | None = None,
    progress: Progress | None = None,
) -> Structure:
    """Find the steady states of the noise-free system from a grid of starts, and the basin of each on a grid.

    Parameters
    ----------
    osc : Oscillator
    region : Region or ((x_min, x_max), (v_min, v_max)), optional
        Where to look; by default a region that holds the steady states and the stops with room around them.
    cells : (int, int)
        Cells of the basin grid in x and v.
    starts : (int, int)
        Starts of the search in x and v.
    settling : float
        Distance, as a fraction of the region's size, at which an attractor counts as reached.
    budget : int, optional
        Most periods to wait for a trajectory to settle; by default by the damping.
    stepper : Stepper, optional
    rng : int or numpy.random.Generator
        Moves the grid of starts off lattice points of symmetry by a random fraction of a cell.
    executor : concurrent.futures.Executor, optional
    progress : callable, optional
        Called with (blocks done, blocks in all).

    Returns
    -------
    Structure

    Raises
    ------
    StructureError
        No damping, or no attractor of period up to 16 in the region.
    NoSectionError
        The excitations have no common period.
    """
    wait = _wait(osc) if budget is None else _checked_budget(budget)
    cells, starts = _checked_counts("cells", cells), _checked_counts("starts", starts)
    if isinstance(settling, bool) or not isinstance(settling, int | float) or not 0 < settling <= 0.5:
        raise StructureError(f"settling is {settling!r}; give a share of the region's size, above 0 and at most 0.5.")
    chosen = stepper or ensemble_stepper(osc, Flow.STATE)
    exact = stepper or single_stepper(osc, Flow.STATE_VARIATIONAL)
    search = _search_region(osc) if region is None else Region.of(region)
    states = _starts(osc, search, starts, generator_from(rng))
    orbits, unsettled = _orbits(osc, states, wait, (chosen, exact), executor, progress)
    if not orbits:
        raise StructureError(
            f"no steady state of period up to {_LONGEST_PERIOD} was found from {len(states)} starts in x ∈ {search.x}, "
            f"v ∈ {search.v} within {wait} periods; widen the region or raise budget."
        )
    found = [_described(osc, orbit, points, exact) for orbit, points in orbits]
    found.sort(key=lambda attractor: (attractor.impacts, attractor.period, tuple(attractor.points[0])))
    frame = _frame(osc, found) if region is None else search
    tolerance = settling * float(np.min(np.diff(frame.bounds)))
    labels = settle(
        osc, _padded(osc, frame.cell_centres(cells)), [attractor.points for attractor in found],
        tolerance=tolerance, budget=wait, stepper=chosen, executor=executor, progress=progress,
    )  # fmt: skip
    basins = Basins(frame, labels.astype(np.int16).reshape(cells))
    attractors = tuple(_with_basin(attractor, label, basins) for label, attractor in enumerate(found))
    status = _status(len(attractors), len(states), unsettled, basins)
    return Structure(attractors, basins, tolerance, wait, status)


def _wait(osc: Oscillator) -> int:
    rate = osc.damping_ratio * osc.natural_frequency
    if rate == 0:
        raise StructureError("the scene has damping_ratio 0, and undamped motion has no attractors; give it damping.")
    slowest = rate if osc.damping_ratio < 1 else osc.natural_frequency / (2 * osc.damping_ratio)
    return min(_LONGEST_WAIT, _LEAST_WAIT + math.ceil(_FOLDS / (slowest * osc.section_interval)))


def _checked_budget(budget: Any) -> int:
    if isinstance(budget, bool) or not isinstance(budget, int) or not 1 <= budget <= _MOST_CELLS:
        raise StructureError(f"budget is {budget!r}; give a whole number of periods, 1 or more.")
    return budget


def _checked_counts(name: str, counts: Any) -> tuple[int, int]:
    pair = tuple(counts) if isinstance(counts, tuple | list) else ()
    whole = len(pair) == 2 and all(isinstance(n, int) and not isinstance(n, bool) and n >= 1 for n in pair)
    if not whole or pair[0] * pair[1] > _MOST_CELLS:
        raise StructureError(
            f"{name} is {counts!r}; give two whole numbers, 1 or more, whose product is at most {_MOST_CELLS}."
        )
    return pair[0], pair[1]


def _search_region(osc: Oscillator) -> Region:
    """A region wide enough for starts: the stops, and the reach of a linear oscillator under the same forces."""
    numbers = [value for part in osc.excitations for name, value in part.parameters.items() if name in _STRENGTHS]
    push = float(sum(abs(number) for number in numbers))
    reach = max([1.0, push / osc.natural_frequency**2, *(2 * abs(barrier.position) for barrier in osc.barriers)])
    return Region((-reach, reach), (-reach * osc.natural_frequency, reach * osc.natural_frequency))


def _starts(osc: Oscillator, region: Region, counts: tuple[int, int], rng: np.random.Generator) -> Array:
    low, high = region.bounds.T
    shift = (rng.random(2) - 0.5) * (high - low) / np.array(counts)
    return _padded(osc, region.cell_centres(counts) + shift)


def _padded(osc: Oscillator, states: Array) -> Array:
    extra = len(osc.noise.extra_states) if osc.noise else 0
    return np.pad(states, ((0, 0), (0, extra)))


def _orbits(
    osc: Oscillator,
    states: Array,
    wait: int,
    steppers: tuple[Stepper, Stepper],
    executor: concurrent.futures.Executor | None,
    progress: Progress | None,
) -> tuple[list[tuple[Orbit, Array]], int]:
    """Return the distinct stable orbits that the starts come to, and how many starts come to none.

    The first stepper carries the starts, the second refines the orbits. What has not settled is given more time, for
    chaotic transients can be long.
    """
    orbits: list[tuple[Orbit, Array]] = []
    lost = 0
    for _ in range(_ROUNDS):
        ended = run_ensemble(osc, Flow.STATE, steppers[0], states, wait, executor=executor, progress=progress)
        lost += int(np.sum(ended.intervals < wait))
        states = _add_orbits(osc, ended.states[ended.intervals == wait], steppers, orbits)
        if not len(states):
            break
    return orbits, lost + len(states)


def _add_orbits(
    osc: Oscillator, states: Array, steppers: tuple[Stepper, Stepper], orbits: list[tuple[Orbit, Array]]
) -> Array:
    """Add the new stable orbits that states lie on to `orbits`; return the states that lie on none."""
    carrier, refiner = steppers
    history = [states]
    for _ in range(_LONGEST_PERIOD):
        history.append(run_ensemble(osc, Flow.STATE, carrier, history[-1], 1).states)
    path = np.array(history)
    scale = 1.0 + np.abs(path).max(axis=(0, 2))
    close = np.linalg.norm(path[1:] - path[0], axis=2) / scale < _RECURRENCE
    settled = close.any(axis=0)
    for index in np.flatnonzero(settled):
        period = int(np.argmax(close[:, index])) + 1
        if any(_same(path[0, index], known, _NEAR) for _, known in orbits):
            continue
        try:
            orbit = _least_period(osc, refine_orbit(osc, path[0, index], period, refiner), refiner)
        except StructureError:
            settled[index] = False
            continue
        visited = _visited(osc, orbit, refiner)
        if np.abs(np.linalg.eigvals(orbit.monodromy)).max() >= 1 or not _same(path[0, index], visited, _NEAR):
            settled[index] = False  # passing by a saddle
        elif not any(_same(orbit.point, known, _EQUAL) for _, known in orbits):
            orbits.append((orbit, visited))
    return path[0, ~settled]


def _least_period(osc: Oscillator, orbit: Orbit, stepper: Stepper) -> Orbit:
    """Return the orbit with its least period: recurrences close to a bifurcation can show a multiple of it."""
    for divisor in range(1, orbit.period):
        if orbit.period % divisor == 0:
            try:
                shorter = refine_orbit(osc, orbit.point, divisor, stepper)
            except StructureError:
                continue
            if _same(orbit.point, shorter.point[None], _EQUAL):
                return shorter
    return orbit


def _visited(osc: Oscillator, orbit: Orbit, stepper: Stepper) -> Array:
    points = [orbit.point]
    for _ in range(orbit.period - 1):
        points.append(run_ensemble(osc, Flow.STATE, stepper, points[-1][None], 1).states[0])
    return np.array(points)


def _same(point: Array, known: Array, tolerance: float) -> bool:
    nearest = np.linalg.norm(known - point, axis=1).min()
    return bool(nearest < tolerance * (1.0 + np.abs(known).max()))


def _described(osc: Oscillator, orbit: Orbit, points: Array, stepper: Stepper) -> Attractor:
    duration = orbit.period * osc.section_interval
    count = _SAMPLES * orbit.period
    path = record(osc, Flow.STATE, stepper, orbit.point, 0.0, duration / count, count)
    resting = osc.autonomous and np.ptp(path, axis=0).max() < 1e-6 * (1.0 + np.abs(path).max())
    hits = tuple(_hits(barrier.sign * (path[:, 0] - barrier.position)) for barrier in osc.barriers)
    return Attractor(
        label=UNSETTLED,
        kind="equilibrium" if resting else "periodic",
        period=orbit.period,
        points=points,
        multipliers=np.linalg.eigvals(orbit.monodromy).astype(complex),
        impacts=sum(hits),
        hits=hits,
        basin_fraction=0.0,
        basin_fraction_error=0.0,
        residual=orbit.residual,
    )


def _hits(depth: Array) -> int:
    """Count entries into contact along a closed orbit."""
    touching = depth[:-1] > 0
    return int(np.sum(touching & ~np.roll(touching, 1)))


def _frame(osc: Oscillator, attractors: list[Attractor]) -> Region:
    """The region of the basin grid: attractors and stops, with room around them."""
    points = np.concatenate([attractor.points[:, :2] for attractor in attractors])
    reach = np.abs(points - points.mean(axis=0)).max()
    places = [[barrier.position, 0.0] for barrier in osc.barriers]
    speed = max(
        reach * osc.natural_frequency, np.abs(points[:, 1]).max(), 0.5 * np.ptp([p[0] for p in places] or [0.0])
    )
    corners = np.array([*points, *places, [points[0, 0], speed], [points[0, 0], -speed]])
    return Region.around(corners, margin=0.25)


def _with_basin(attractor: Attractor, label: int, basins: Basins) -> Attractor:
    share = basins.fraction(label)
    error = math.sqrt(share * (1 - share) / basins.labels.size)
    return dataclasses.replace(attractor, label=label, basin_fraction=share, basin_fraction_error=error)


def _status(attractors: int, starts: int, unsettled: int, basins: Basins) -> str:
    words = [f"{attractors} steady state{'s' if attractors != 1 else ''} found from {starts} starts."]
    if unsettled:
        words.append(f"{unsettled} starts did not settle on an orbit of period up to {_LONGEST_PERIOD}.")
    lost = basins.fraction(UNSETTLED)
    if lost:
        words.append(f"{100 * lost:.2g}% of the cells did not settle in the time given.")
    return " ".join(words)
