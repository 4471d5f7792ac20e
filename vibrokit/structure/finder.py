"""Finder: the stages of `find_structure` (`search` for attractors, then basins, boundaries) with their results."""

from __future__ import annotations

import concurrent.futures
import math
from collections.abc import Iterator, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import StructureError
from vibrokit.kernels.choice import LOCATED, ensemble_stepper, single_stepper
from vibrokit.kernels.fixed_steps import RK4
from vibrokit.kernels.named import name_of
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.progress import Work, put_off, stage
from vibrokit.results.attractor import Attractor
from vibrokit.results.basins import ESCAPED, UNSETTLED
from vibrokit.results.codes import Code
from vibrokit.results.finding import Finding
from vibrokit.results.region import Region
from vibrokit.results.saddle import Manifold
from vibrokit.results.stoppable import Stoppable
from vibrokit.results.structure import Structure
from vibrokit.scene_file import scene_data
from vibrokit.structure.along_x import states_at, turn_of
from vibrokit.structure.attractors.names import labelled, order_of
from vibrokit.structure.basins.classifier import BasinClassifier
from vibrokit.structure.basins.grid import SETTLING, BasinGrid, with_fractions
from vibrokit.structure.basins.landings import copies_in, lies_in, on_circle
from vibrokit.structure.basins.stop_cells import MARGIN
from vibrokit.structure.boundaries.saddles import SOON, SaddleSearch
from vibrokit.structure.manifolds import BRANCHES, default_arc_length, grow_manifolds
from vibrokit.structure.neutral import refuse_unheld
from vibrokit.structure.persistence import LONGEST_WAIT, periods_of, persistent_stepper, slowest_rate, wait_of
from vibrokit.structure.regions import frame_of, regions_over_tops, search_region
from vibrokit.structure.rest import in_front_of_stops, tops_around
from vibrokit.structure.scales import length_of
from vibrokit.structure.search import Search
from vibrokit.structure.validation import Request
from vibrokit.symbolic.flow_kind import Flow

_WIDENINGS = 2  # of the region

Array = NDArray[np.float64]


class Finder:
    """Goes through the stages and keeps what each has found; arguments and errors as of `find_structure`."""

    def __init__(self, osc: Oscillator, request: Request, executor: concurrent.futures.Executor | None) -> None:
        self.osc, self.request, self.region, self.executor = osc, request, request.region, executor
        self.rng = np.random.default_rng(request.rng)
        refuse_unheld(osc)
        self.wait = wait_of(osc)
        self.budget = request.budget or self.wait
        self.orbit_stepper = request.stepper or single_stepper(osc, Flow.STATE_VARIATIONAL)
        self.stepper = request.stepper or ensemble_stepper(osc, Flow.STATE)
        self.searched = self.region or search_region(osc)
        self.search = Search(osc, self.searched, SETTLING, self._search_stepper(), self.orbit_stepper, executor)
        self.attractors: tuple[Attractor, ...] = ()
        self.circle = False  # whether states a turn apart along x are one
        self.grid: BasinGrid | None = None
        self.saddle_search: SaddleSearch | None = None
        self.manifolds: tuple[Manifold, ...] = ()
        self.without_manifolds: list[Finding] = []
        self.work = Stoppable("attractors")

    def run(self, *, basins: bool = True) -> None:
        """Go through the stages; an interrupt ends them, and what is known by then is kept. Saddles need basins."""
        stages = {"attractors": self._find_attractors} | ({"basins": self._find_basins} if basins else {})
        stages |= {"saddles": self._find_saddles} if self.request.saddles else {}
        stages |= {"manifolds": self._grow_manifolds} if self.request.saddles and self.request.manifolds else {}
        with self.work:
            for self.work.doing, find in stages.items():
                find()
        with put_off():
            self._order()

    def _search_stepper(self) -> Stepper:
        """A stepper finer than the basins need: too few steps can destroy a weak attractor."""
        if self.request.stepper is not None or not isinstance(self.stepper, RK4):
            return self.stepper
        finer = self.stepper.refined().refined()
        return finer if finer.steps <= 1024 else LOCATED  # above, that is cheaper and far more accurate

    def _find_attractors(self) -> None:
        """Search from a grid of starts, and choose a stepper with which every attractor persists."""
        # One region is that of the expected motion, the other contains the tops of barriers around it.
        regions = [self.searched, *([] if self.region is not None else regions_over_tops(self.osc, self.searched))]
        starts = [_starts(self.osc, region, self.request.starts, self.rng) for region in regions]
        self.search.run(np.concatenate(starts), self.budget, self.budget >= self.wait)
        if not self.search.attractors:
            raise StructureError(self.search.failure(self.budget, self.wait))
        self._add_rests()
        self._order()
        if self.region is not None and not any(lies_in(self.region, found) for found in self.attractors):
            raise StructureError(_none_inside(self.region, self.attractors))
        self._choose_stepper()
        lifetimes = [survival.lifetime for survival in self.search.survival if np.isfinite(survival.lifetime)]
        if self.request.budget is None:
            slow = [periods_of(self.osc, rate) for rate in map(slowest_rate, self.attractors) if rate > 0]
            waits = [self.budget, *slow, *(math.ceil(5 * lifetime) for lifetime in lifetimes)]
            self.budget = min(LONGEST_WAIT, max(waits))

    def _add_rests(self) -> None:
        """Add the equilibria of the region around what was found, which may be wider than that of the search."""
        (low, high), widened = self.searched.x, self.osc.autonomous and self.region is None
        for _ in range(_WIDENINGS * widened):
            low, high = min(low, self.frame.x[0]), max(high, self.frame.x[1])
            if (low, high) == self.searched.x or not self.search.add_rests(low, high):
                return
            del self.frame

    def _choose_stepper(self) -> None:
        if self.request.stepper is None:
            distances = self.settling * self.frame.widths
            self.stepper = persistent_stepper(self.osc, self.attractors, self.stepper, distances)

    def _order(self) -> None:
        """Sort the attractors and name them, unless that was done."""
        if self.attractors:
            return
        self.circle = on_circle(self.osc, self.search.attractors, self.region)
        one_each = self.circle or self.region is None
        found = sorted(copies_in(self.osc, self.search.attractors, self.frame, one_each=one_each), key=order_of)
        self.attractors = labelled(found, has_stops=bool(self.osc.barriers))

    @cached_property
    def frame(self) -> Region:
        """Region of the basin grid."""
        if self.region is not None or not self.search.attractors:
            return self.searched
        return frame_of(self.osc, self.search.attractors)

    @cached_property
    def settling(self) -> float:
        """Distance at which a state counts as settled, in widths; less than that between a node and a saddle."""
        gaps = np.diff([float(rest.point[0]) for rest in self.search.at_rest]) / self.frame.widths[0]
        return float(min([self.request.settling, *(0.25 * gaps)]))

    @property
    def classifier(self) -> BasinClassifier:
        """Finds the attractor that a state leads to."""
        return BasinClassifier(
            self.osc, self.attractors, self.frame, self.settling, self.budget, self.stepper, self.executor,
            circle=self.circle,
        )  # fmt: skip

    def _find_basins(self) -> None:
        """Classify every cell of the grid, and set the basin fraction of each attractor.

        Motion that ends outside the region, or has not settled, is followed on. Where it shows an attractor, the region
        is widened to contain that, unless it was given, and the grid is filled again.
        """
        for _ in range(_WIDENINGS):
            self._fill_grid()
            if not self._find_more():
                return
            self.attractors = ()
            for cached in ("frame", "settling"):
                vars(self).pop(cached, None)
            self._add_rests()
            self._order()
            self._choose_stepper()
        self._fill_grid()

    def _find_more(self) -> bool:
        """Search from cells that lead to no attractor; return whether there is one more."""
        assert self.grid is not None
        labels, region = self.grid.basins.labels, self.grid.basins.region
        lost = np.flatnonzero(np.isin(labels, (ESCAPED, UNSETTLED)))
        some = lost[:: -(-len(lost) // 64)] if len(lost) else lost
        return self.search.go_on(states_at(self.osc, region.cell_centres(labels.shape)[some]), self.budget)

    def _fill_grid(self) -> None:
        request = self.request
        self.grid = BasinGrid(self.classifier, request.cells, margin=request.margin, refine=request.refine)
        try:
            self.grid.fill()
        finally:
            self.attractors = with_fractions(self.attractors, self.grid.basins)

    def _find_saddles(self) -> None:
        """Track the boundaries between basins to the saddles on them."""
        assert self.grid is not None
        # By located contacts a section takes as long as a thousand steps. The budget is that of 10 to 20 s.
        steps = self.stepper.steps_in(self.osc, self.osc.section_interval) or 1000
        self.saddle_search = SaddleSearch(
            self.classifier, self.grid.basins, self.orbit_stepper,
            sections=max(SOON, math.ceil(0.25 * self.wait)), margin=self.request.margin or MARGIN,
            budget=self.request.edge_budget or min(10**7, 5 * 10**9 // steps),
        )  # fmt: skip
        self.saddle_search.run(self.rng)

    def _grow_manifolds(self) -> None:
        """Grow the manifolds of each saddle that is an orbit."""
        assert self.saddle_search is not None
        every = enumerate(self.saddle_search.saddles)
        saddles = [(n, one) for n, one in every if one.kind in ("saddle", "flip saddle") and not one.embedded]
        count = sum(4 * len(saddle.points) for _, saddle in saddles)
        length = default_arc_length(self.frame, max(count, 1))
        most_sections = 3_000_000 / max(count, 1)  # all branches together then take 10 to 20 s with stops
        with stage("manifolds", unit=BRANCHES, total=count):
            for index, saddle in saddles:
                known = self.manifolds
                try:
                    for branch in grow_manifolds(
                        self.osc, index, saddle,
                        region=self.frame, arc_length=length, most_sections=most_sections,
                        stepper=self.request.stepper, executor=self.executor,
                    ):  # fmt: skip
                        self.manifolds += (branch,)
                except StructureError as error:
                    self.manifolds = known
                    self.without_manifolds.append(Finding.of(Code.NO_MANIFOLDS, saddle=index, reason=str(error)))

    def structure(self, work: Work) -> Structure:
        """Return the record of all that was found."""
        saddles = self.saddle_search
        grid = self.grid or BasinGrid(self.classifier, self.request.cells)
        return Structure(
            attractors=self.attractors,
            saddles=saddles.saddles if saddles else (),
            manifolds=self.manifolds,
            basins=grid.basins,
            survival=self.search.survival,
            settling=self.settling,
            budget=self.budget,
            stepper=name_of(self.stepper),
            shift=turn_of(self.osc),
            circle=self.circle,
            complete=not self.work.stopped,
            scene=scene_data(self.osc),
            settings=self.request.settings,
            findings=self._findings(grid),
            stats=work.stats,
            seed=self.request.rng,
            seconds=work.seconds,
        )

    def _findings(self, grid: BasinGrid) -> tuple[Finding, ...]:
        search, region = self.search, grid.basins.region
        found = [Finding.of(Code.STEADY_STATES, count=len(self.attractors), starts=search.starts)]
        if shift := turn_of(self.osc):
            found.append(Finding.of(Code.ON_CIRCLE if self.circle else Code.SHIFTED_COPIES, shift=shift))
        found += search.endings
        found += [search.progress] if self.work.stopped and self.work.doing == "attractors" else []
        found += [*self._outside(region), *search.findings, *grid.findings]
        if (saddles := self.saddle_search) is not None:
            found += saddles.findings
            outside = sum(not lies_in(region, saddle) for saddle in saddles.saddles)
            found += [Finding.of(Code.SADDLES_OUTSIDE, count=outside)] if outside else []
        return (*found, *self.without_manifolds, *self.work.findings)

    def _outside(self, region: Region) -> Iterator[Finding]:
        """Findings about attractors and tops of barriers that lie outside a region."""
        if outside := sum(not lies_in(region, attractor) for attractor in self.attractors):
            (x_min, x_max), (v_min, v_max) = frame_of(self.osc, self.attractors).bounds.tolist()
            bounds = {"x_min": x_min, "x_max": x_max, "v_min": v_min, "v_max": v_max}
            yield Finding.of(Code.REGION_TOO_SMALL, count=outside, **bounds)
        if self.attractors and not self.circle:
            x = np.concatenate([attractor.orbit[:, 0] for attractor in self.attractors])
            tops = tops_around(self.osc, float(x.min()), float(x.max()), length_of(self.osc))
            for place in sorted(top.place for top in in_front_of_stops(self.osc, tops)):
                if not region.x[0] <= place <= region.x[1]:
                    yield Finding.of(Code.TOPS_OUTSIDE, place=place)


def _starts(osc: Oscillator, region: Region, counts: tuple[int, int], rng: np.random.Generator) -> Array:
    low, high = region.bounds.T
    shift = (rng.random(2) - 0.5) * (high - low) / np.array(counts)
    return states_at(osc, region.cell_centres(counts) + shift)


def _none_inside(region: Region, attractors: Sequence[Attractor]) -> str:
    """Return that steady states were found, but none in the region."""
    places = ", ".join(f"({a.points[0, 0]:.6g}, {a.points[0, 1]:.6g})" for a in attractors)
    return (
        f"no steady state lies in x ∈ {region.x}, v ∈ {region.v}; starts from there reach those at {places}. Give a "
        "region that contains one of them, or no region."
    )
