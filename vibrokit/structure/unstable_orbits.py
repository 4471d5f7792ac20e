"""Unstable orbits on request: all of one period that Newton's method finds from a grid of starts."""

from __future__ import annotations

import concurrent.futures
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import StructureError
from vibrokit.kernels.choice import ensemble_stepper, single_stepper
from vibrokit.kernels.ensemble import Progress, run_ensemble
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.results.region import Region
from vibrokit.results.saddle import Saddle
from vibrokit.structure.boundaries.unstable import branch_fates, describe_unstable, refine_unstable, short_interval
from vibrokit.structure.orbits import EQUAL, Orbit, same_point, visited
from vibrokit.structure.regions import search_region, states_at
from vibrokit.structure.request import check_means, pair, whole
from vibrokit.structure.scales import size_of
from vibrokit.structure.settle import Settler
from vibrokit.symbolic.flow_kind import Flow

_FINER = 8  # times as many cells on a side as starts: looked at for where the map turns round
_ITERATIONS = 60
_LEAST_SHARE = 1e-3  # of a Newton step, below which a start is given up
_LONGEST_STEP = 0.25  # of the region's size
_CONVERGED = 1e-9
_APART = 1e-5  # of the region's size: how far the carrier's orbits may be from the exact ones and be known for them
_LONGEST_PERIOD = 10_000
_MOST_STARTS = 10**6

Array = NDArray[np.float64]


def unstable_orbits(
    osc: Oscillator,
    period: int,
    *,
    region: Any = None,
    starts: tuple[int, int] = (32, 32),
    stepper: Stepper | None = None,
    settler: Settler | None = None,
    executor: concurrent.futures.Executor | None = None,
    progress: Progress | None = None,
) -> tuple[Saddle, ...]:
    """Find the unstable orbits of one period: saddles, flip saddles and repellers, inside basins and between them.

    Newton's method with damped steps is begun on a grid, and in the cells of a grid eight times as fine round which
    the map takes x both ways and v both ways, which finds saddles that few starts come to, as those born at grazing;
    its derivative is that of the variational equations. What it comes to is refined with contacts located. There is
    no proof that all are found: more starts find more, where there are many.

    Parameters
    ----------
    osc : Oscillator
    period : int
        In forcing periods, 1 or more; orbits of lesser period are left out. In a scene without periodic excitation 1,
        for its equilibria.
    region : Region or ((x_min, x_max), (v_min, v_max)), optional
        Where at least one point of an orbit must be; by default a region that holds the stops, and what a linear
        oscillator would reach.
    starts : (int, int)
        Starts in x and v.
    stepper : Stepper, optional
        For everything; by default fixed steps for the starts and located contacts for what they come to.
    settler : Settler, optional
        Says where what leaves an orbit goes; without it `leads_to` is empty.
    executor : concurrent.futures.Executor, optional
    progress : callable, optional
        Called with (blocks done, blocks in all) in each iteration.

    Returns
    -------
    tuple of Saddle
        In the order of their points of least x.

    Raises
    ------
    StructureError
        A period that is no whole number, 1 or more, or is not 1 without periodic excitation; a region inside out.
    NoSectionError
        The excitations have no common period.
    """
    check_means(osc, stepper, executor, progress)
    period = whole("period", period, 1, _LONGEST_PERIOD)
    if osc.autonomous and period != 1:
        raise StructureError(
            f"period is {period}, but the scene has no periodic excitation; give 1, for its equilibria."
        )
    counts = pair("starts", starts, _MOST_STARTS)
    where = search_region(osc) if region is None else Region.of(region)
    carrier = stepper or ensemble_stepper(osc, Flow.STATE_VARIATIONAL)
    exact = stepper or single_stepper(osc, Flow.STATE_VARIATIONAL)
    mapping = stepper or ensemble_stepper(osc, Flow.STATE)
    turning = _turning_cells(osc, period, where, (_FINER * counts[0], _FINER * counts[1]), mapping, executor)
    begin = states_at(osc, np.concatenate([where.cell_centres(counts), turning]))
    roots = _Newton(osc, period, carrier, where.size, executor, progress).roots(begin)
    found = []
    for orbit, points in _distinct(osc, roots, period, exact, _APART * where.size):
        inside = np.all((points[:, :2] >= where.bounds[:, 0]) & (points[:, :2] <= where.bounds[:, 1]), axis=1)
        if inside.any() and np.abs(np.linalg.eigvals(orbit.monodromy)).max() > 1:
            fates = () if settler is None else branch_fates(settler, orbit)
            found.append(describe_unstable(osc, orbit, exact, fates))
    return tuple(sorted(found, key=lambda saddle: tuple(saddle.points[0])))


def _turning_cells(
    osc: Oscillator,
    period: int,
    region: Region,
    cells: tuple[int, int],
    stepper: Stepper,
    executor: concurrent.futures.Executor | None,
) -> Array:
    """Return centres (count, 2) of cells round which the map takes x both ways and v both ways."""
    axes = [np.linspace(low, high, count + 1) for (low, high), count in zip(region.bounds, cells, strict=True)]
    corners = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    ended = run_ensemble(
        osc, Flow.STATE, stepper, states_at(osc, corners), period,
        interval=short_interval(osc), executor=executor,
    )  # fmt: skip
    moved = (ended.states[:, :2] - corners).reshape(cells[0] + 1, cells[1] + 1, 2)
    moved[(ended.intervals < period).reshape(moved.shape[:2])] = np.nan
    four = np.stack([moved[:-1, :-1], moved[1:, :-1], moved[:-1, 1:], moved[1:, 1:]])
    with np.errstate(invalid="ignore"):
        both = np.all((four.min(axis=0) <= 0) & (four.max(axis=0) >= 0), axis=-1)
    return region.cell_centres(cells)[both.ravel()]


class _Newton:
    """Newton's method from many starts at once, each with a step length of its own."""

    def __init__(
        self,
        osc: Oscillator,
        period: int,
        stepper: Stepper,
        size: float,
        executor: concurrent.futures.Executor | None,
        progress: Progress | None,
    ) -> None:
        self.osc, self.period, self.stepper, self.size = osc, period, stepper, size
        self.executor, self.progress = executor, progress

    def roots(self, points: Array) -> Array:
        """Return the states that the map takes to themselves, as often as they were come to."""
        offsets, steps = self._looked_at(points)
        shares = np.ones(len(points))
        roots = []
        for _ in range(_ITERATIONS):
            sizes = np.linalg.norm(offsets, axis=1)
            done = sizes < _CONVERGED * (size_of(self.osc) + np.linalg.norm(points, axis=1))
            roots.append(points[done])
            going = ~done & np.isfinite(steps).all(axis=1) & (shares > _LEAST_SHARE)
            points, offsets, steps, shares, sizes = (a[going] for a in (points, offsets, steps, shares, sizes))
            if not len(points):
                break
            tried = points + shares[:, None] * steps
            new_offsets, new_steps = self._looked_at(tried)
            better = np.linalg.norm(new_offsets, axis=1) < sizes  # never where it is not finite
            points[better], offsets[better], steps[better] = tried[better], new_offsets[better], new_steps[better]
            shares = np.where(better, np.minimum(1.0, 2 * shares), shares / 4)
        return np.concatenate(roots)

    def _looked_at(self, points: Array) -> tuple[Array, Array]:
        """How far the map takes each state, and the Newton step from it, not longer than the region allows."""
        count, size = points.shape
        identity = np.broadcast_to(np.eye(size).ravel(), (count, size * size))
        ended = run_ensemble(
            self.osc, Flow.STATE_VARIATIONAL, self.stepper, np.hstack([points, identity]), self.period,
            interval=short_interval(self.osc), executor=self.executor, progress=self.progress,
        )  # fmt: skip
        carried = ended.intervals == self.period
        offsets = np.where(carried[:, None], ended.states[:, :size] - points, np.nan)
        slopes = ended.states[:, size:].reshape(count, size, size) - np.eye(size)
        solvable = np.isfinite(slopes).all(axis=(1, 2)) & carried
        solvable[solvable] = np.abs(np.linalg.det(slopes[solvable])) > 0
        steps = np.full_like(points, np.nan)
        steps[solvable] = -np.linalg.solve(slopes[solvable], offsets[solvable, :, None])[..., 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            longest = _LONGEST_STEP * self.size / np.linalg.norm(steps, axis=1, keepdims=True)
            return offsets, steps * np.minimum(1.0, longest)


def _distinct(osc: Oscillator, roots: Array, period: int, stepper: Stepper, apart: float) -> list[tuple[Orbit, Array]]:
    """Refine roots, each orbit of the period once; return them with their points."""
    known: list[tuple[Orbit, Array]] = []
    seen = np.empty((0, roots.shape[1]))
    for root in roots[np.lexsort(roots.T[::-1])]:
        if len(seen) and np.linalg.norm(seen - root, axis=1).min() < apart:
            continue
        seen = np.vstack([seen, root])
        try:
            orbit = refine_unstable(osc, root, period, stepper)
        except StructureError:  # an orbit of the coarser map alone
            continue
        points = visited(osc, orbit, stepper)
        seen = np.vstack([seen, points])
        if orbit.period == period and not any(same_point(osc, orbit.point, other, EQUAL) for _, other in known):
            known.append((orbit, points))
    return known
