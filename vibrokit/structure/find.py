"""Finds what the noise-free system does: steady states, basins, saddles, manifolds."""

from __future__ import annotations

import concurrent.futures
import dataclasses
import math
import time
from numbers import Integral
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import StructureError, shown
from vibrokit.kernels.choice import ensemble_stepper, single_stepper
from vibrokit.kernels.ensemble import Progress
from vibrokit.kernels.named import name_of
from vibrokit.kernels.rk4 import RK4
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator, generator_from
from vibrokit.results.attractor import Attractor
from vibrokit.results.basins import NOT_FOLLOWED, Basins
from vibrokit.results.manifold import Manifold
from vibrokit.results.region import Region
from vibrokit.results.saddle import Saddle
from vibrokit.results.structure import Structure
from vibrokit.results.versions import versions
from vibrokit.scene_file import scene_data
from vibrokit.structure.boundaries.saddles import find_saddles
from vibrokit.structure.manifolds import grow_manifolds
from vibrokit.structure.regions import frame_of, search_region, states_at
from vibrokit.structure.request import Request, check_means
from vibrokit.structure.search import LONGEST_PERIOD, Means, Search, lasting_carrier
from vibrokit.structure.settle import Settler, settle_grid
from vibrokit.structure.shares import with_basin
from vibrokit.structure.status import lies_in, none_inside, nothing_found, status_of
from vibrokit.symbolic.flow_kind import Flow

_FOLDS = 30  # e-foldings of the linear damping that a transient is given
_LEAST_WAIT = 200
_LONGEST_WAIT = 20_000
_LIFETIMES = 5  # of chaotic transients that a cell is given
_SEARCH_SETTLING = 1e-3
_MOST_STEPS = 8192  # beyond which locating contacts is as quick

Array = NDArray[np.float64]


def find_structure(
    osc: Oscillator,
    *,
    region: Any = None,
    cells: tuple[int, int] = (200, 200),
    refine: int = 0,
    margin: int | None = 2,
    starts: tuple[int, int] = (24, 24),
    settling: float = 1e-3,
    budget: int | None = None,
    saddles: bool = True,
    manifolds: bool = True,
    stepper: Stepper | None = None,
    rng: int | np.random.Generator = 0,
    executor: concurrent.futures.Executor | None = None,
    progress: Progress | None = None,
) -> Structure:
    """Find the steady states of the noise-free system, their basins, the saddles between them and their manifolds.

    Starts on a grid are followed until they recur; each orbit is refined by Newton's method on the variational
    equations. What does not recur is watched for 20000 periods at two accuracies of integration, and taken for an
    attractor only if it survives both; its largest Lyapunov exponent says of which kind. Basins are found on a grid,
    saddles by following the basins' boundaries, manifolds from the saddles.

    If the work is stopped (Ctrl-C) once an attractor is known, what was found so far is returned, marked incomplete.

    Parameters
    ----------
    osc : Oscillator
    region : Region or ((x_min, x_max), (v_min, v_max)), optional
        Where to look; by default a region that holds the steady states and the stops with room around them.
    cells : (int, int)
        Cells of the basin grid in x and v.
    refine : int
        How many times cells near a boundary are halved; the grid then has ``cells · 2**refine`` cells.
    margin : int, optional
        Cells on every side that must agree before a coarser cell answers for the trajectories that enter it. More is
        surer and slower; None has every trajectory followed to its attractor.
    starts : (int, int)
        Starts of the search in x and v.
    settling : float
        Distance, as a fraction of the region's size, at which an attractor counts as reached.
    budget : int, optional
        Most periods to wait for a trajectory to settle; by default by the damping, and by the lifetime of chaotic
        transients where there are some.
    saddles, manifolds : bool
        Whether to look for them. Manifolds need saddles.
    stepper : Stepper, optional
        For everything; by default fixed steps for many trajectories and located contacts for orbits.
    rng : int or numpy.random.Generator
        Moves the grid of starts off lattice points of symmetry by a random fraction of a cell.
    executor : concurrent.futures.Executor, optional
    progress : callable, optional
        Called with (work done, work in all) of the stage under way.

    Returns
    -------
    Structure

    Raises
    ------
    StructureError
        No damping, or no attractor in the region.
    NoSectionError
        The excitations have no common period.
    """
    check_means(osc, stepper, executor, progress)
    for name, flag in (("saddles", saddles), ("manifolds", manifolds)):
        if not isinstance(flag, bool):
            raise StructureError(f"{name} is {shown(flag)}; give True or False.")
    request = Request(cells, refine, margin, starts, settling, budget)
    finder = _Finder(osc, request, None if region is None else Region.of(region), stepper, executor, progress)
    generator = generator_from(rng)
    try:
        finder.find_attractors(generator)
        finder.find_basins()
        if saddles:
            finder.find_saddles(generator)
        if saddles and manifolds:
            finder.grow_manifolds()
    except KeyboardInterrupt:
        if not finder.search.attractors:
            raise
        finder.stopped = True
    return finder.structure(int(rng) if isinstance(rng, Integral) else None)


class _Finder:
    """Goes through the stages and keeps what each has found."""

    def __init__(
        self,
        osc: Oscillator,
        request: Request,
        region: Region | None,
        stepper: Stepper | None,
        executor: concurrent.futures.Executor | None,
        progress: Progress | None,
    ) -> None:
        self.began = time.perf_counter()
        self.osc, self.request, self.region, self.given = osc, request, region, stepper
        self.executor, self.progress = executor, progress
        self.wait = _wait(osc)
        self.budget = self.wait if request.budget is None else int(request.budget)
        self.exact = stepper or single_stepper(osc, Flow.STATE_VARIATIONAL)
        self.carrier = stepper or ensemble_stepper(osc, Flow.STATE)
        self.looked_in = region or search_region(osc)
        means = Means(self._search_carrier(), self.exact, executor, progress)
        self.search = Search(osc, means, _SEARCH_SETTLING * self.looked_in.size)
        self.attractors: tuple[Attractor, ...] = ()
        self.basins: Basins | None = None
        self.saddles: list[Saddle] = []
        self.manifolds: tuple[Manifold, ...] = ()
        self.words: list[str] = []
        self.stopped = False
        self.missing = "attractors, basins, saddles and manifolds"

    def _search_carrier(self) -> Stepper:
        """Finer than the basins need: a weak attractor must not be lost to the steps."""
        if self.given is not None or not isinstance(self.carrier, RK4):
            return self.carrier
        finer = self.carrier.refined().refined()
        return finer if finer.steps <= _MOST_STEPS else self.exact

    def find_attractors(self, generator: np.random.Generator) -> None:
        """Search from a grid of starts, and see for which carrier every attractor is one."""
        starts = _starts(self.osc, self.looked_in, self.request.starts, generator)
        self.search.run(starts, self.budget, self.budget >= self.wait)
        if not self.search.attractors:
            hasty = self.budget < self.wait
            raise StructureError(nothing_found(self.search, self.looked_in, self.budget, hasty, LONGEST_PERIOD))
        self._settle_order()
        if self.region is not None and not any(lies_in(self.region, found) for found in self.attractors):
            raise StructureError(none_inside(self.region, self.attractors))
        if self.given is None:
            self.carrier = lasting_carrier(self.osc, self.attractors, self.carrier, self.tolerance)
        lifetimes = [report.lifetime for report in self.search.survival if np.isfinite(report.lifetime)]
        if self.request.budget is None and lifetimes:
            self.budget = min(_LONGEST_WAIT, max(self.budget, math.ceil(_LIFETIMES * max(lifetimes))))

    def _settle_order(self) -> None:
        found = sorted(self.search.attractors, key=lambda a: (not a.repeats, a.impacts, a.period, tuple(a.points[0])))
        self.attractors = tuple(dataclasses.replace(attractor, label=n) for n, attractor in enumerate(found))

    @property
    def frame(self) -> Region:
        """Region of the basin grid."""
        return self.region or frame_of(self.osc, self.attractors)

    @property
    def tolerance(self) -> float:
        """Distance at which an attractor counts as reached."""
        return float(self.request.settling) * self.frame.size

    def settler(self) -> Settler:
        """What says where states lead."""
        return Settler(self.osc, self.attractors, self.frame, self.tolerance, self.budget, self.carrier, self.executor)

    def find_basins(self) -> None:
        """Follow every cell of the grid, and note the share of each attractor."""
        request = self.request
        self.missing = "basins, saddles and manifolds"
        self.basins = settle_grid(
            self.settler(), request.cells, margin=request.margin, refine=request.refine, progress=self.progress
        )
        self.attractors = tuple(with_basin(attractor, self.basins) for attractor in self.attractors)
        if (self.basins.labels == NOT_FOLLOWED).any():
            raise KeyboardInterrupt

    def find_saddles(self, generator: np.random.Generator) -> None:
        """Follow the boundaries between basins to the saddles on them."""
        assert self.basins is not None
        self.missing = "saddles and manifolds"
        settler = self.settler().sharing(self.basins, self.request.margin or 2)
        ordered, words = find_saddles(
            self.osc, settler, self.basins, self.attractors,
            carrier=self.carrier, exact=self.exact, rng=generator, found=self.saddles,
        )  # fmt: skip
        self.saddles = list(ordered)
        self.words.append(words)
        outside = sum(not lies_in(self.frame, saddle) for saddle in ordered)
        if outside:
            self.words.append(f"{outside} of these lie outside the region; a wider one shows them.")

    def grow_manifolds(self) -> None:
        """Grow the manifolds of each saddle that is an orbit."""
        self.missing = "manifolds"
        for index, saddle in enumerate(self.saddles):
            if saddle.kind not in ("saddle", "flip saddle"):
                continue
            try:
                self.manifolds += grow_manifolds(
                    self.osc, index, saddle, region=self.frame, stepper=self.given, executor=self.executor
                )
            except StructureError as error:
                self.words.append(f"Saddle {index} has no manifolds: {error}")

    def structure(self, seed: int | None) -> Structure:
        """The record of all that was found."""
        if not self.attractors:
            self._settle_order()
        basins = self.basins
        if basins is None:
            basins = Basins(self.frame, np.full(self.request.cells, NOT_FOLLOWED, dtype=np.int16))
        return Structure(
            attractors=self.attractors,
            saddles=tuple(self.saddles),
            manifolds=self.manifolds,
            basins=basins,
            survival=self.search.survival,
            settling=self.tolerance,
            budget=self.budget,
            stepper=name_of(self.carrier),
            complete=not self.stopped,
            status=status_of(
                self.search, len(self.attractors), basins, self.missing if self.stopped else "", self.words
            ),
            scene=scene_data(self.osc),
            seed=seed,
            seconds=time.perf_counter() - self.began,
            versions=versions(),
        )


def _wait(osc: Oscillator) -> int:
    rate = osc.damping_ratio * osc.natural_frequency
    if rate == 0 and osc.model.undamped:
        raise StructureError(
            "nothing in the scene takes energy out (damping_ratio is 0, the stops are elastic), and undamped motion "
            "has no attractors; give it damping."
        )
    slowest = rate if osc.damping_ratio < 1 else osc.natural_frequency / (2 * osc.damping_ratio)
    if slowest == 0:
        return _LEAST_WAIT
    return min(_LONGEST_WAIT, _LEAST_WAIT + math.ceil(_FOLDS / (slowest * osc.section_interval)))


def _starts(osc: Oscillator, region: Region, counts: tuple[int, int], rng: np.random.Generator) -> Array:
    low, high = region.bounds.T
    shift = (rng.random(2) - 0.5) * (high - low) / np.array(counts)
    return states_at(osc, region.cell_centres(counts) + shift)
