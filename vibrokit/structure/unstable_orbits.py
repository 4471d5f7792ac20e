"""Unstable orbits that Newton's method finds: from a grid of starts, or from close returns of a chaotic motion."""

from __future__ import annotations

import concurrent.futures
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from vibrokit.arguments import pair, whole
from vibrokit.construction import called
from vibrokit.errors import StructureError, shown
from vibrokit.kernels.choice import ensemble_stepper, single_stepper
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.vector_field import VectorField
from vibrokit.oscillator import Oscillator
from vibrokit.progress import TRAJECTORIES, Progress, stage, working
from vibrokit.results.region import Region
from vibrokit.results.saddle import Saddle
from vibrokit.structure.along_x import states_at
from vibrokit.structure.autonomous import equilibrium_equations
from vibrokit.structure.basins.classifier import BasinClassifier
from vibrokit.structure.boundaries.unstable import branch_limits, describe_unstable, refine_unstable
from vibrokit.structure.newton import Evaluation, newton, scaled
from vibrokit.structure.orbits import (
    EQUAL,
    Orbit,
    least_period,
    refine_orbit,
    same_point,
    section_equations,
    visited,
)
from vibrokit.structure.regions import search_region
from vibrokit.structure.scales import units_of
from vibrokit.structure.validation import check_means
from vibrokit.symbolic.flow_kind import Flow

Array = NDArray[np.float64]


@called
def unstable_orbits(
    osc: Oscillator,
    period: int,
    *,
    region: Any = None,
    starts: tuple[int, int] = (32, 32),
    stepper: Stepper | None = None,
    classifier: BasinClassifier | None = None,
    executor: concurrent.futures.Executor | None = None,
    progress: Progress = None,
    time_limit: float | None = None,
) -> tuple[Saddle, ...]:
    """Find the unstable orbits of one period: saddles, flip saddles and repellers, inside basins and between them.

    Newton's method with damped steps starts from a grid, and from those cells of an eight times finer grid at whose
    corners the map's shifts of x and of v both change sign. These find saddles that few starts converge to, such as
    those created at grazing. The derivative is that of the variational equations; what it converges to is refined with
    located contacts. There is no guarantee that all orbits are found; more starts may find more.

    Nothing is returned on Ctrl-C, which raises KeyboardInterrupt, or after the time limit.

    Parameters
    ----------
    osc : Oscillator
    period : int
        In forcing periods, 1 or more; orbits of smaller period are left out. In a scene without periodic excitation
        1, for its equilibria.
    region : Region or ((x_min, x_max), (v_min, v_max)), optional
        Where at least one point of an orbit must be; by default a region that contains the stops and the reach of a
        linear oscillator.
    starts : (int, int)
        Starts in x and v.
    stepper : Stepper, optional
        For everything; by default fixed steps for the starts and located contacts for the refinement.
    classifier : BasinClassifier, optional
        Finds the attractors that motion from an orbit leads to; without it `leads_to` is empty.
    executor : concurrent.futures.Executor, optional
    progress : bool or callable, optional
        True shows progress on standard error; a function is called with each `vibrokit.progress.Update`.
    time_limit : float, optional
        In seconds.

    Returns
    -------
    tuple of Saddle
        In the order of their points of least x.

    Raises
    ------
    OutOfTime
        The time limit was reached.
    StructureError
        The period is not a whole number, 1 or more, or is not 1 without periodic excitation; the region is not one.
    NoSectionError
        The excitations have no common period.
    """
    check_means(osc, stepper, executor)
    if classifier is not None and not isinstance(classifier, BasinClassifier):
        raise StructureError(f"classifier must be a BasinClassifier or None, got {shown(classifier)}.")
    period = whole("period", period, 1, 10_000)
    if osc.autonomous and period != 1:
        raise StructureError(
            f"period must be 1, for equilibria, because the scene has no periodic excitation; got {period}."
        )
    counts = pair("starts", starts, 10**6)
    where = search_region(osc) if region is None else Region.of(region)
    orbit_stepper = stepper or single_stepper(osc, Flow.STATE_VARIATIONAL)
    found = []
    with working(progress, time_limit), stage("unstable orbits", unit=TRAJECTORIES):
        finer = (8 * counts[0], 8 * counts[1])
        turning = _turning_cells(osc, period, where, finer, stepper or ensemble_stepper(osc, Flow.STATE), executor)
        guesses = states_at(osc, np.concatenate([where.cell_centres(counts), turning]))
        equations = equilibrium_equations(osc)
        if not osc.autonomous:
            many = stepper or ensemble_stepper(osc, Flow.STATE_VARIATIONAL)
            equations = section_equations(osc, period, many, executor)
        roots = _roots(osc, equations, guesses, where)
        for orbit, points in _distinct(osc, roots, period, orbit_stepper, where):
            if where.contains(points).any() and np.abs(orbit.multipliers).max() > 1:
                limits = () if classifier is None else branch_limits(classifier, orbit)
                found.append(describe_unstable(osc, orbit, orbit_stepper, limits))
    return tuple(sorted(found, key=lambda saddle: tuple(saddle.points[0])))


def _turning_cells(
    osc: Oscillator,
    period: int,
    region: Region,
    cells: tuple[int, int],
    stepper: Stepper,
    executor: concurrent.futures.Executor | None,
) -> Array:
    """Return centres (count, 2) of cells at whose corners the map's shifts of x and of v both change sign."""
    axes = [np.linspace(low, high, count + 1) for (low, high), count in zip(region.bounds, cells, strict=True)]
    corners = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    states = states_at(osc, corners)
    if osc.autonomous:
        moved = VectorField(osc).rate(states)
    else:
        ended = run_ensemble(osc, Flow.STATE, stepper, states, period, executor=executor)
        moved = np.where((ended.intervals == period)[:, None], ended.states - states, np.nan)
    moved = moved[:, :2].reshape(cells[0] + 1, cells[1] + 1, 2)
    four = np.stack([moved[:-1, :-1], moved[1:, :-1], moved[:-1, 1:], moved[1:, 1:]])
    with np.errstate(invalid="ignore"):
        both = np.all((four.min(axis=0) <= 0) & (four.max(axis=0) >= 0), axis=-1)
    return region.cell_centres(cells)[both.ravel()]


def _roots(osc: Oscillator, equations: Callable[[Array], Evaluation], starts: Array, region: Region) -> Array:
    """Return the places that damped Newton steps of limited length converge to, one for each start that does."""

    def limited(places: Array, steps: Array) -> Array:
        with np.errstate(divide="ignore", invalid="ignore"):
            longest = 0.25 / np.linalg.norm(region.scaled(steps), axis=1, keepdims=True)
        return steps * np.minimum(1.0, longest)

    def converged(places: Array, sizes: Array) -> NDArray[np.bool_]:
        return np.asarray(sizes < 1e-9 * (1.0 + np.linalg.norm(places / units, axis=1)))

    units = units_of(osc)

    places, sizes, _ = newton(
        scaled(equations, units),
        starts,
        iterations=60,
        least_fraction=1e-3,
        limited=limited,
        converged=converged,
    )
    return places[converged(places, sizes)]


def _distinct(
    osc: Oscillator, roots: Array, period: int, stepper: Stepper, region: Region
) -> list[tuple[Orbit, Array]]:
    """Refine roots; return each orbit of the period once, with its points."""
    known: list[tuple[Orbit, Array]] = []
    seen = np.empty((0, roots.shape[1]))
    for root in roots[np.lexsort(roots.T[::-1])]:
        if len(seen) and region.apart(seen, root).min() < 1e-5:  # as far as the coarser map moves an orbit
            continue
        seen = np.vstack([seen, root])
        try:
            orbit = refine_unstable(osc, root, period, stepper)
        except StructureError:  # only the coarser map has this orbit
            continue
        points = visited(osc, orbit, stepper)
        seen = np.vstack([seen, points])
        if orbit.period == period and not any(same_point(osc, orbit.point, other, EQUAL) for _, other in known):
            known.append((orbit, points))
    return known


def orbits_inside(osc: Oscillator, points: Array, stepper: Stepper, most: int, longest: int) -> tuple[Orbit, ...]:
    """Find unstable periodic orbits inside a chaotic set, the shortest periods first, `most` at most.

    A chaotic motion passes near each of them: where it nearly returns after some periods, Newton's method finds the
    orbit (Lathrop & Kostelich, Phys. Rev. A 40, 4028, 1989). The points (count, n) sample the set on the section: one
    motion, or several one after the other, in the order of time. Periods are at most `longest`.
    """
    spacing = float(np.median(cKDTree(points).query(points, k=2)[0][:, 1]))
    found: list[Orbit] = []
    known = np.empty((0, points.shape[1]))
    for period in range(1, min(longest, len(points) - 1) + 1):
        apart = np.linalg.norm(points[period:] - points[:-period], axis=1)
        for start in np.argsort(apart)[:4]:
            if apart[start] > 4 * max(spacing, float(apart.min())) or apart[start] > 0.1 * np.ptp(points):
                break
            try:
                orbit = refine_orbit(osc, points[start], period, stepper)
                orbit = least_period(osc, orbit, stepper)
                if len(known) and same_point(osc, orbit.point, known, EQUAL):
                    continue
                visits = visited(osc, orbit, stepper)
            except StructureError:
                continue
            unstable = float(np.abs(orbit.multipliers).max()) > 1
            if unstable and cKDTree(points).query(visits)[0].max() < 50 * spacing:
                found.append(orbit)
                known = np.concatenate([known, visits])
            if len(found) == most:
                return tuple(found)
    return tuple(found)
