"""Basins on a grid, from coarse grids to fine ones that use the coarse ones; basin fractions."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vibrokit.kernels.choice import ensemble_stepper
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.progress import advance, stage
from vibrokit.results.attractor import Attractor
from vibrokit.results.basins import AT_COPY, ESCAPED, NOT_FOLLOWED, UNSETTLED, Basins
from vibrokit.results.codes import Code
from vibrokit.results.finding import Finding
from vibrokit.results.region import Region
from vibrokit.structure.along_x import states_at
from vibrokit.structure.basins.classifier import CELLS, BasinClassifier
from vibrokit.structure.basins.landings import on_circle
from vibrokit.structure.basins.stop_cells import FINEST, MARGIN, agreeing
from vibrokit.structure.persistence import persistent_stepper
from vibrokit.structure.validation import DEFAULT_CELLS
from vibrokit.symbolic.flow_kind import Flow

_COARSEST = 4096  # cells of the first grid, followed to the attractors; fewer by default where that takes long
_MOST_FIRST = 20_000_000  # sections that the first grid may take by default
_MOST_SECTIONS = 5_000_000  # that the finer of two grids may take by default, about 10 s with stops
SETTLING = 1e-3  # of the region's widths, the default of `find_structure`
_WITHOUT_ATTRACTOR = {
    UNSETTLED: Code.CELLS_UNSETTLED, ESCAPED: Code.CELLS_LEFT_REGION, NOT_FOLLOWED: Code.CELLS_NOT_FOLLOWED,
    AT_COPY: Code.CELLS_AT_COPIES,
}  # fmt: skip
CELL_CODES = tuple(_WITHOUT_ATTRACTOR.values())
"""Codes of the findings about cells that lead to no attractor."""

Labels = NDArray[np.int16]
Mask = NDArray[np.bool_]


def classify_grid(
    classifier: BasinClassifier, cells: tuple[int, int], *, margin: int | None = MARGIN, refine: int = 0
) -> Basins:
    """Label the cells of the classifier's region; parameters as for `BasinGrid`."""
    grid = BasinGrid(classifier, cells, margin=margin, refine=refine)
    grid.fill()
    return grid.basins


class BasinGrid:
    """The cells of a classifier's region; an interrupt leaves the labels known so far.

    The first grid is followed to the attractors. On each finer one a trajectory ends, after one section at least, in a
    cell of the grid before whose whole neighbourhood agrees; see `vibrokit.structure.basins.stop_cells`.
    `cells` are those of the last grid; None: 200 × 200, or the finest before it that takes at most 5 · 10⁶ sections.
    `margin` is how far cells must agree to classify a trajectory; None: every cell is followed to an attractor. The
    cells near a boundary are split in four `refine` times; the others keep their labels.
    """

    def __init__(
        self,
        classifier: BasinClassifier,
        cells: tuple[int, int] | None,
        *,
        margin: int | None = MARGIN,
        refine: int = 0,
    ) -> None:
        self._classifier, self._margin, self._refine = classifier, margin, refine
        self._most_sections = math.inf if cells is not None else _MOST_SECTIONS
        coarsest = _COARSEST if cells is not None else min(_COARSEST, max(400, _MOST_FIRST // classifier.budget))
        whole = cells or DEFAULT_CELLS
        self._shapes = _shapes(whole, coarsest) if margin is not None else [whole]
        self._labels = np.full(whole, NOT_FOLLOWED, dtype=np.int16)
        self._sections = 0  # that the last grid took
        self._refined = False  # whether an attractor lay in a cell of another basin
        self._avoided = 0  # sections that the grid after the last one would take, if they are too many

    @property
    def basins(self) -> Basins:
        """The labels of cells · 2^refine cells; NOT_FOLLOWED where they are not known yet."""
        labels = self._labels
        while labels.shape[0] < self._shapes[-1][0] * 2**self._refine:
            labels = _split(labels)
        return Basins(self._classifier.region, labels)

    def fill(self) -> None:
        """Follow all cells."""
        counts = [math.prod(shape) for shape in self._shapes]
        splits = sum(4**split for split in range(1, self._refine + 1))
        total = sum(counts) + splits * counts[-1]
        classifier = self._classifier
        with stage("basins", unit=CELLS, total=total):
            for level, shape in enumerate(self._shapes[:-1]):
                coarse = np.full(shape, NOT_FOLLOWED, dtype=np.int16)
                self._follow(coarse, classifier)
                classifier = self._sharing(coarse)
                expected = self._expected(classifier)
                if expected > self._most_sections:
                    self._shapes, self._labels, self._avoided = self._shapes[: level + 1], coarse, expected
                    advance(sum(counts[level + 1 :]) + splits * (counts[-1] - counts[level]))
                    break
            else:
                self._follow(self._labels, classifier)
            for _ in range(self._refine):
                self._split_near(~agreeing(self._labels, max(1, self._margin or 0)), self._sharing(self._labels))
        self._find_lost()

    def _find_lost(self) -> None:
        """Refine the grid until no attractor lies in a cell of another basin.

        It ends at 2048 cells along a side, or where a grid took more sections than the first one may by default.
        Cells that put an attractor into another basin are too wide to tell what lies around them either. So few cells
        are all followed anew, and of many cells none near a lost attractor classifies others.
        """
        while (lost := self._lost()) and 2 * max(self._labels.shape) <= FINEST and self._sections <= _MOST_FIRST:
            self._refined = True
            with stage("basins of lost attractors", unit=CELLS, total=4 * self._labels.size):
                if self._labels.size <= _COARSEST:
                    self._split_near(np.ones(self._labels.shape, dtype=bool), self._classifier)
                    continue
                around, region = self._labels.copy(), self._classifier.region
                for label in lost:
                    places, inside = region.cells_at(self._classifier.attractors[label].points, around.shape)
                    around[tuple(places[inside].T)] = UNSETTLED
                self._split_near(~agreeing(around, max(1, self._margin or 0)), self._sharing(around))

    def _lost(self) -> list[int]:
        """Labels of the attractors that lie in cells of another basin."""
        basins, attractors = self.basins, self._classifier.attractors
        return [label for label, attractor in enumerate(attractors) if basins.lost(attractor, label)]

    def _split_near(self, near: Mask, classifier: BasinClassifier) -> None:
        """Split all cells in four, and follow the parts of some of them."""
        self._labels = _split(np.where(near, NOT_FOLLOWED, self._labels).astype(np.int16))
        self._follow(self._labels, classifier)

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Findings about the cells that lead to no attractor, and about a grid coarser than the default."""
        found = cell_findings(self.basins)
        if self._avoided:
            nx, nv = self._shapes[-1]
            found += (Finding.of(Code.COARSE_GRID, nx=nx, nv=nv, sections=self._avoided),)
        nx, nv = self._labels.shape
        if self._refined:
            found += (Finding.of(Code.GRID_REFINED, nx=nx, nv=nv),)
        return found + tuple(Finding.of(Code.ATTRACTOR_LOST, label, nx=nx, nv=nv) for label in self._lost())

    def _sharing(self, finished: Labels) -> BasinClassifier:
        """Return a classifier that uses a finished grid, if it may."""
        if self._margin is None:
            return self._classifier
        return self._classifier.sharing(Basins(self._classifier.region, finished), self._margin)

    def _expected(self, classifier: BasinClassifier) -> int:
        """Return about how many sections the next grid takes.

        It has four times the cells; of these, the ones in cells that classify need one section, the others as many as
        now.
        """
        assert classifier.core is not None
        labels = classifier.core.labels
        return 4 * (int(np.sum(labels >= 0)) + round(self._sections * float(np.mean(labels < 0))))

    def _follow(self, labels: Labels, classifier: BasinClassifier) -> None:
        """Follow the cells that are not known yet, some at a time."""
        self._sections = 0
        places, centres = np.flatnonzero(labels == NOT_FOLLOWED), classifier.region.cell_centres(labels.shape)
        advance(labels.size - len(places))
        chunk = 2**15  # cells that are followed together: more need more memory, and are no faster
        for start in range(0, len(places), chunk):
            part = places[start : start + chunk]
            found = np.full(len(part), NOT_FOLLOWED, dtype=np.int64)
            try:
                self._sections += classifier.label(found, states_at(classifier.osc, centres[part]))
            finally:
                labels.flat[part] = found


def _shapes(cells: tuple[int, int], coarsest: int) -> list[tuple[int, int]]:
    """Grids from coarse to fine, halved down to one of so many cells or fewer."""
    shapes = [cells]
    while math.prod(shapes[-1]) > coarsest:
        shapes.append((-(-shapes[-1][0] // 2), -(-shapes[-1][1] // 2)))
    return shapes[::-1]


def _split(labels: Labels) -> Labels:
    return labels.repeat(2, axis=0).repeat(2, axis=1)


def with_fractions(attractors: Sequence[Attractor], basins: Basins) -> tuple[Attractor, ...]:
    """Return attractors with their basin fractions, and the standard errors of these.

    They are those of Jeffreys' posterior: cells that all lead to one attractor do not exclude a share of the others.
    """
    found, count = [], basins.labels.size
    for attractor in attractors:
        fraction = basins.fraction(attractor.label)
        cells, others = count * fraction + 0.5, count * (1 - fraction) + 0.5
        error = math.sqrt(cells * others / (count + 2)) / (count + 1)
        found.append(dataclasses.replace(attractor, basin_fraction=fraction, basin_fraction_error=error))
    return tuple(found)


def cell_findings(basins: Basins) -> tuple[Finding, ...]:
    """Return findings about the cells that lead to no attractor."""
    fractions = {code: basins.fraction(label) for label, code in _WITHOUT_ATTRACTOR.items()}
    return tuple(Finding.of(code, fraction=fraction) for code, fraction in fractions.items() if fraction)


def basin_fractions(
    osc: Oscillator,
    attractors: Sequence[Attractor],
    region: Region,
    cells: tuple[int, int],
    budget: int,
    stepper: Stepper | None,
) -> tuple[tuple[Attractor, ...], tuple[Finding, ...]]:
    """Find the basin fraction of each attractor in a region, and findings about the cells that lead to none."""
    chosen = stepper or persistent_stepper(osc, attractors, ensemble_stepper(osc, Flow.STATE), SETTLING * region.widths)
    circle = on_circle(osc, attractors, region)
    classifier = BasinClassifier(osc, attractors, region, SETTLING, budget, chosen, circle=circle)
    basins = classify_grid(classifier, cells)
    return with_fractions(attractors, basins), cell_findings(basins)
