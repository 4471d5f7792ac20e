"""Where states of the section lead: one by one, and on a grid whose cells share their answers."""

from __future__ import annotations

import concurrent.futures
import dataclasses
import math
from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vibrokit.kernels.ensemble import Ensemble, Progress, Stop, run_ensemble
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.stopping import LEFT_BASIN, LEFT_REGION, NOT_FINITE, REACHED, STALLED
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.results.basins import LEFT, NOT_FOLLOWED, UNSETTLED, Basins
from vibrokit.results.region import Region
from vibrokit.structure.basins.arrival import arrival_at
from vibrokit.structure.basins.sharing import agreeing, centres, core_of
from vibrokit.structure.basins.spread import Painting, is_spread, paint
from vibrokit.symbolic.flow_kind import Flow

_FIRST_STAGE = 8  # sections after which those still on the way are packed together anew
_CONFIRMED = 64  # sections that must stay by a spread attractor before it counts as reached
_MISSES = 6  # of them that may fall where its sample has gaps
_COARSEST = 4096  # cells of the first grid, followed to the attractors
_LONGEST_DETOUR = 6  # as a power of 2
_CHUNK = 2**15  # cells between two looks at Ctrl-C

Array = NDArray[np.float64]
Whole = NDArray[np.int64]
Labels = NDArray[np.int16]
Mask = NDArray[np.bool_]


@dataclasses.dataclass(frozen=True, eq=False)
class Settler:
    """Tells to which attractor a state of the section leads.

    A periodic orbit or an equilibrium is reached within `tolerance` of one of its points. An attractor that meets the
    section in a curve or a cloud (a limit cycle, quasiperiodic and chaotic motion) is painted on a fine grid; a
    trajectory that enters a painted cell must stay by it for 64 sections more, else it is followed further.

    Attributes
    ----------
    osc : Oscillator
    attractors : sequence of Attractor
        A label is a place in this sequence.
    region : Region
        Tells trajectories that have left from those that have not settled; leaving it on the way is no end.
    tolerance : float
        Distance in (x, v) at which a point counts as reached.
    budget : int
        Most sections to wait; those that confirm a spread attractor may come on top.
    stepper : Stepper
    executor : concurrent.futures.Executor, optional
    core : Basins, optional
        Cells that answer for trajectories that are in them at a section; negative labels for cells that do not.
    """

    osc: Oscillator
    attractors: Sequence[Attractor]
    region: Region
    tolerance: float
    budget: int
    stepper: Stepper
    executor: concurrent.futures.Executor | None = None
    core: Basins | None = None

    def labels(self, states: Array, start_time: float = 0.0, progress: Progress | None = None) -> Whole:
        """Return the label of the attractor that each state leads to.

        Parameters
        ----------
        states : array (count, n)
        start_time : float
            Time at which they start (s); they are carried to the next section first.
        progress : callable, optional
            Called with (states done, states in all).

        Returns
        -------
        int64 array (count,)
            UNSETTLED where the budget was spent inside the region, LEFT where it was spent outside or the numbers ran
            out of range.
        """
        journey = _Journey(self, states)
        journey.to_section(start_time)
        stage = _FIRST_STAGE
        while (going := journey.going()).size:
            ended = journey.advance(going, stage, self.entering)
            entered = np.where((ended.status == LEFT_BASIN) & (journey.found[going] == NOT_FOLLOWED), ended.label, -1)
            for place, stop in self.leaving.items():
                journey.confirm(going[entered == place + len(self.attractors)], place, stop)
            journey.wander(going[(entered >= 0) | (ended.status == LEFT_REGION)])
            journey.close()
            stage = min(4 * stage, self.budget)
            if progress is not None:
                progress(int(np.sum(journey.found != NOT_FOLLOWED)), len(states))
        return journey.found

    def sharing(self, basins: Basins, margin: int) -> Settler:
        """Return one to which a finished grid answers, which is quick: see `vibrokit.structure.basins.sharing`."""
        return dataclasses.replace(self, core=core_of(self.osc, self.stepper, basins, margin, self.executor))

    @cached_property
    def points(self) -> Stop:
        """The test for having reached an orbit or an equilibrium."""
        orbits = {place: a.points for place, a in enumerate(self.attractors) if not is_spread(a)}
        return arrival_at(orbits, self.tolerance)

    @cached_property
    def entering(self) -> Stop:
        """The test for points, cells that answer, and painted cells, whose labels lie beyond the attractors'."""
        if self._painting is not None:
            labels = self._painting.labels(self.core, len(self.attractors))
            return dataclasses.replace(self.points, region=self._painting.frame.bounds, labels=labels)
        if self.core is not None:
            return dataclasses.replace(self.points, region=self.core.region.bounds, labels=self.core.labels)
        return self.points

    @cached_property
    def leaving(self) -> dict[int, Stop]:
        """For each spread attractor, by place, the test for being away from it."""
        painting = self._painting
        if painting is None:
            return {}
        here = dataclasses.replace(self.points, region=painting.frame.bounds)
        return {place: dataclasses.replace(here, labels=painting.away(place)) for place in painting.near}

    @cached_property
    def _painting(self) -> Painting | None:
        return paint(self.attractors, self.region, self.tolerance)


class _Journey:
    """Trajectories on their way: where they are, how many sections they have left, and where they have arrived."""

    def __init__(self, settler: Settler, states: Array) -> None:
        self.settler = settler
        self.states = np.array(states, dtype=float)
        self.left = np.full(len(states), settler.budget, dtype=np.int64)
        self.found = np.full(len(states), NOT_FOLLOWED, dtype=np.int64)
        self.detours = np.zeros(len(states), dtype=np.int64)

    def going(self) -> Whole:
        return np.flatnonzero(self.found == NOT_FOLLOWED)

    def to_section(self, start_time: float) -> None:
        """Carry states that start between two sections to the next one."""
        osc = self.settler.osc
        phase = 0.0 if osc.autonomous else start_time % osc.section_interval
        if phase > 0 and len(self.states):
            rest = osc.section_interval - phase
            ended = run_ensemble(
                osc, Flow.STATE, self.settler.stepper, self.states, start_time=phase, interval=rest,
                executor=self.settler.executor,
            )  # fmt: skip
            self.states = ended.states
            self.found[ended.status == NOT_FINITE] = LEFT

    def advance(self, which: Whole, most: int | Whole, stop: Stop) -> Ensemble:
        """Carry some on, by at most so many sections, and note what they reach for certain."""
        settler = self.settler
        budget = np.minimum(self.left[which], most)
        ended = run_ensemble(
            settler.osc, Flow.STATE, settler.stepper, self.states[which], budget, stop=stop, executor=settler.executor
        )
        self.states[which] = ended.states
        self.left[which] -= ended.intervals
        self.left[which[ended.status == STALLED]] = 0
        self.found[which[ended.status == NOT_FINITE]] = LEFT
        answered = (ended.status == LEFT_BASIN) & (ended.label < len(settler.attractors))
        sure = (ended.status == REACHED) | (answered & (stop is settler.entering))
        self.found[which[sure]] = ended.label[sure]
        return ended

    def confirm(self, which: Whole, place: int, stop: Stop) -> None:
        """Give a spread attractor's label to those that stay by it."""
        self.left[which] += _CONFIRMED
        stayed, misses = np.zeros(len(which), dtype=np.int64), np.zeros(len(which), dtype=np.int64)
        open_ = np.arange(len(which))
        while open_.size:
            ended = self.advance(which[open_], _CONFIRMED - stayed[open_], stop)
            stayed[open_] += ended.intervals
            misses[open_] += (ended.status == LEFT_BASIN) | (ended.status == LEFT_REGION)
            still = (self.found[which] == NOT_FOLLOWED) & (stayed < _CONFIRMED) & (misses <= _MISSES)
            open_ = open_[still[open_] & (ended.intervals > 0)]
        sure = (self.found[which] == NOT_FOLLOWED) & (stayed >= _CONFIRMED) & (misses <= _MISSES)
        self.found[which[sure]] = place
        self.left[which] -= _CONFIRMED

    def wander(self, which: Whole) -> None:
        """Carry those that are outside, or by no attractor after all, on for a while, each time twice as long."""
        which = which[(self.found[which] == NOT_FOLLOWED) & (self.left[which] > 0)]
        if which.size:
            self.advance(which, 2 ** np.minimum(self.detours[which], _LONGEST_DETOUR), self.settler.points)
            self.detours[which] += 1

    def close(self) -> None:
        """Tell those whose time is up from those that go on."""
        over = np.flatnonzero((self.found == NOT_FOLLOWED) & (self.left <= 0))
        bounds = self.settler.region.bounds
        inside = np.all((self.states[over, :2] >= bounds[:, 0]) & (self.states[over, :2] <= bounds[:, 1]), axis=1)
        self.found[over] = np.where(inside, UNSETTLED, LEFT)


def settle_grid(
    settler: Settler,
    cells: tuple[int, int],
    *,
    margin: int | None = 2,
    refine: int = 0,
    progress: Progress | None = None,
) -> Basins:
    """Label the cells of the settler's region, from coarse grids to fine ones.

    The first grid is followed to the attractors. On each finer one a trajectory ends, after one section at least, in a
    cell of the grid before that answers for its neighbourhood; see `vibrokit.structure.basins.sharing`.

    Parameters
    ----------
    settler : Settler
    cells : (int, int)
        Cells in x and in v.
    margin : int, optional
        How far cells must agree to answer. None: every cell is followed to an attractor.
    refine : int
        How many times the cells near a boundary are split in four; the others are taken over.
    progress : callable, optional
        Called with (cells done, cells in all), all grids together.

    Returns
    -------
    Basins
        Of cells · 2^refine cells. After Ctrl-C, NOT_FOLLOWED in those that were not done.
    """
    shapes = _shapes(cells) if margin is not None else [(int(cells[0]), int(cells[1]))]
    counts = [math.prod(shape) for shape in shapes]
    tally = _Tally(progress, sum(counts) + sum(counts[-1] * 4**split for split in range(1, refine + 1)))
    grid = np.full(shapes[-1], NOT_FOLLOWED, dtype=np.int16)
    finished = None
    try:
        for shape in shapes:
            level = grid if shape == shapes[-1] else np.full(shape, NOT_FOLLOWED, dtype=np.int16)
            finished = _filled(settler, level, finished, margin, tally)
        for _ in range(refine):
            near = ~agreeing(grid, max(1, margin or 0))
            grid = _split(np.where(near, NOT_FOLLOWED, grid).astype(np.int16))
            finished = _filled(settler, grid, finished, margin, tally)
    except KeyboardInterrupt:
        while grid.shape[0] < shapes[-1][0] * 2**refine:
            grid = _split(grid)
    return Basins(settler.region, grid)


class _Tally:
    """Counts cells for the caller's progress."""

    def __init__(self, progress: Progress | None, total: int) -> None:
        self.progress, self.total, self.done = progress, total, 0

    def add(self, count: int) -> None:
        self.done += count
        if count and self.progress is not None:
            self.progress(self.done, self.total)


def _shapes(cells: tuple[int, int]) -> list[tuple[int, int]]:
    """Grids from coarse to fine, halved down to one that is quickly followed."""
    shapes = [(int(cells[0]), int(cells[1]))]
    while math.prod(shapes[-1]) > _COARSEST:
        shapes.append((-(-shapes[-1][0] // 2), -(-shapes[-1][1] // 2)))
    return shapes[::-1]


def _filled(settler: Settler, labels: Labels, coarser: Basins | None, margin: int | None, tally: _Tally) -> Basins:
    """Follow the cells not followed yet, in pieces, so that what is done survives Ctrl-C."""
    if coarser is not None and margin is not None:
        settler = settler.sharing(coarser, margin)
    places = np.flatnonzero(labels == NOT_FOLLOWED)
    tally.add(labels.size - len(places))
    for start in range(0, len(places), _CHUNK):
        part = places[start : start + _CHUNK]
        labels.flat[part] = settler.labels(centres(settler.osc, settler.region, labels.shape, part))
        tally.add(len(part))
    return Basins(settler.region, labels)


def _split(labels: Labels) -> Labels:
    return labels.repeat(2, axis=0).repeat(2, axis=1)
