"""Levels: one potential on finer and coarser grids, and with longer steps: how far it can be trusted."""

from __future__ import annotations

import concurrent.futures
import dataclasses
import os
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.candidate import Candidate
from vibrokit.analyzers.screening.grids import Grids, covering
from vibrokit.analyzers.screening.potential import Iteration, Potential
from vibrokit.analyzers.screening.ways_followed import Follower, different
from vibrokit.analyzers.screening.ways_out import Way
from vibrokit.errors import StructureError
from vibrokit.kernels.ensemble import Progress
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.results.structure import Structure

_ROOM = 1.2  # V up to which paths are followed, over the dearest way out
_NEARLY = 0.95  # of that V: a way out that costs more may owe it to the limit
_RAISED = 3.0
_RAISES = 6
_STAGES = 4
_STEP_TOLERANCE = 0.01  # of a cost: by how much linearising over a step may change it
_ZOOMS = 4
_WIDENINGS = 6
_WORTHWHILE = 0.8  # of the area before: more does not pay another round
_BY_PATH = 2.0  # times the difference from a path, which has an excess of its own: its end is held
_BY_STEP = 0.5  # share of what doubling the step changes that counts as error: the price is of second order at least

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class Levels:
    """A potential, and poorer ones.

    Attributes
    ----------
    whole : Potential
        On half as many nodes along each side, of all that the region covers.
    fine : Potential
        On the nodes asked for, of what can be reached for little more than leaving costs.
    coarse : Potential
        The same on half as many nodes along each side.
    long : Potential
        The same with steps twice as long as well.
    from_set : bool
        Whether the attractor is no orbit, but a set that is some cells thick on the grid.
    follower : Follower
    """

    whole: Potential
    fine: Potential
    coarse: Potential
    long: Potential
    from_set: bool
    follower: Follower

    def paths(self, way: Way) -> list[Candidate]:
        """Return the different paths to a way out, the cheapest first."""
        own = (self.fine, self.coarse) if np.isfinite(way.cost(self.fine)) else (self.whole,)
        found = [one for potential in own for one in self.follower.follow(potential, way)]
        return [one.candidate for one in different(found)]

    def cost(self, way: Way) -> tuple[float, float]:
        """Return what a way out costs, and how far this may be wrong.

        The error is what halving the grid changed and the difference from a path's action by Hamilton's equations; or,
        if no path was found, half of what doubling the step changed; from a set also how V rises near by, and where no
        saddle is known how it falls towards the boundary.
        """
        fine, coarse, long = (way.cost(potential) for potential in (self.fine, self.coarse, self.long))
        if not np.isfinite([fine, coarse, long]).all():
            whole = way.cost(self.whole)
            return whole, whole
        paths = self.paths(way)
        blur = way.blur(self.fine) if self.from_set else 0.0
        by_time = _BY_PATH * abs(paths[0].action - fine) if paths else _BY_STEP * abs(coarse - long)
        return fine, abs(fine - coarse) + by_time + blur + way.beyond(self.fine)


def levels(
    osc: Oscillator,
    structure: Structure,
    attractor: Attractor,
    ways: Sequence[Way],
    inside: Callable[[Grids, int], NDArray[np.bool_]],
    stepper: Stepper,
    cells: tuple[int, int],
    fractions: Sequence[int],
    progress: Progress | None = None,
) -> Levels:
    """Find the potential of an attractor; see `Levels`.

    The first of the time fractions is taken with which linearising over a step changes no price by much; but none
    from which on shorter steps take V farther from the price of its paths, for want of cells.

    Raises
    ------
    StructureError
        No way out was reached, or the attractor is not hyperbolic.
    """
    half = (max(16, cells[0] // 2), max(16, cells[1] // 2))
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as executor:
        follower = Follower(osc, stepper, attractor.label)
        work = _Work(osc, structure, attractor, ways, inside, stepper, executor, follower, progress)
        poor = work.poor(fractions[0], half)
        silent = dataclasses.replace(work, progress=None)
        for fraction in fractions[1:]:
            if work.linearising(poor) <= _STEP_TOLERANCE:
                break
            shorter = silent.poor(fraction, half)
            if work.excess(shorter) > max(work.excess(poor), _STEP_TOLERANCE):  # each step adds an error of the cells
                break
            poor = shorter
        fine, _ = work.solved(poor.coarse.grids.of(cells), poor.limit)
        work.tell(_STAGES)
    return Levels(poor.whole, fine, poor.coarse, poor.long, not attractor.is_fixed, follower)


@dataclasses.dataclass(frozen=True, eq=False)
class _Poor:
    """The potentials on half as many nodes along each side, and V up to which they were found."""

    whole: Potential
    coarse: Potential
    long: Potential
    limit: float


@dataclasses.dataclass(frozen=True, eq=False)
class _Work:
    """What all levels share."""

    osc: Oscillator
    structure: Structure
    attractor: Attractor
    ways: Sequence[Way]
    inside: Callable[[Grids, int], NDArray[np.bool_]]
    stepper: Stepper
    executor: concurrent.futures.Executor
    follower: Follower
    progress: Progress | None

    def tell(self, done: int) -> None:
        """Say how far the work is."""
        if self.progress is not None:
            self.progress(done, _STAGES)

    def solved(self, grids: Grids, limit: float) -> tuple[Potential, float]:
        """Iterate on some grids, up to a V that is raised until the ways out are well below it."""
        for _ in range(_RAISES):
            potential = Iteration(self.osc, self.stepper, self.attractor, grids, limit, self.executor).run()
            costs = [way.cost(potential) for way in self.ways]
            dearest = max([cost for cost in costs if np.isfinite(cost)], default=np.inf)
            if dearest < _NEARLY * limit:
                return potential, dearest
            limit *= _RAISED
        raise StructureError(
            f"no way out of attractor {self.attractor.label} was reached on the grid: the region, or the cells asked "
            "for, leave no room for it; widen the region or take more cells."
        )

    def poor(self, fraction: int, cells: tuple[int, int]) -> _Poor:
        """Find the whole potential, cut out what can be reached for little more than leaving costs, and solve there."""
        limit = 2 * max(way.bound for way in self.ways)
        grids = covering(self.osc, self.stepper, self.structure.basins.region, fraction, cells)
        whole, dearest = self.solved(grids, limit)
        for _ in range(_WIDENINGS):
            low = [values < dearest for values in whole.values]
            wider = grids.widened([mask & self.inside(grids, phase) for phase, mask in enumerate(low)])
            if wider is grids:
                break
            grids = wider
            whole, dearest = self.solved(grids, 2 * dearest)
        self.tell(1)
        coarse = whole
        for _ in range(_ZOOMS):
            near = [values < _ROOM * dearest for values in coarse.values]
            zoomed = grids.zoomed([mask & self.inside(grids, phase) for phase, mask in enumerate(near)])
            gain = zoomed.area / grids.area
            if coarse is not whole and gain > _WORTHWHILE:
                break
            grids = zoomed
            coarse, dearest = self.solved(grids, _ROOM * dearest)
        self.tell(2)
        doubled = dataclasses.replace(grids, boxes=grids.boxes[::2], step=2 * grids.step)
        long, _ = self.solved(doubled, _ROOM * dearest)
        self.tell(3)
        return _Poor(whole, coarse, long, _ROOM * dearest)

    def linearising(self, poor: _Poor) -> float:
        """By how much, relative, linearising over a step changes the price of any way out that is in reach."""
        found = [one for way in self.ways for one in self.follower.follow(poor.coarse, way)]
        return max((one.linearising for one in found), default=0.0)

    def excess(self, poor: _Poor) -> float:
        """By how much, relative, V at the ways out differs from the price of a path that it leads along."""
        pairs = [(way.cost(poor.coarse), self.follower.follow(poor.coarse, way)) for way in self.ways]
        return max((abs(cost / found[0].candidate.action - 1) for cost, found in pairs if found), default=0.0)
