"""Basins on a grid, from coarse grids to fine ones whose cells share their answers."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from vibrokit.progress import advance, stage
from vibrokit.results.basins import NOT_FOLLOWED, Basins
from vibrokit.structure.basins.classifier import CELLS, BasinClassifier
from vibrokit.structure.basins.sharing import agreeing, centres

_COARSEST = 4096  # cells of the first grid, followed to the attractors
_CHUNK = 2**15  # cells that are followed together: more need more memory, and are no faster

Labels = NDArray[np.int16]


def classify_grid(
    classifier: BasinClassifier, cells: tuple[int, int], *, margin: int | None = 2, refine: int = 0
) -> Basins:
    """Label the cells of the classifier's region; parameters as for `BasinGrid`."""
    grid = BasinGrid(classifier, cells, margin=margin, refine=refine)
    grid.fill()
    return grid.basins


class BasinGrid:
    """The cells of a classifier's region; an interrupt leaves the labels known so far.

    The first grid is followed to the attractors. On each finer one a trajectory ends, after one section at least, in a
    cell of the grid before whose whole neighbourhood agrees; see `vibrokit.structure.basins.sharing`.

    Parameters
    ----------
    classifier : BasinClassifier
    cells : (int, int)
        Cells in x and in v.
    margin : int, optional
        How far cells must agree to classify a trajectory. None: every cell is followed to an attractor.
    refine : int
        How many times the cells near a boundary are split in four; the others keep their labels.
    """

    def __init__(
        self, classifier: BasinClassifier, cells: tuple[int, int], *, margin: int | None = 2, refine: int = 0
    ) -> None:
        self._classifier, self._margin, self._refine = classifier, margin, refine
        whole = (int(cells[0]), int(cells[1]))
        self._shapes = _shapes(whole) if margin is not None else [whole]
        self._labels = np.full(whole, NOT_FOLLOWED, dtype=np.int16)

    @property
    def basins(self) -> Basins:
        """The labels of cells · 2^refine cells; NOT_FOLLOWED in those that are not known yet."""
        labels = self._labels
        while labels.shape[0] < self._shapes[-1][0] * 2**self._refine:
            labels = _split(labels)
        return Basins(self._classifier.region, labels)

    def fill(self) -> None:
        """Follow all cells."""
        counts = [math.prod(shape) for shape in self._shapes]
        total = sum(counts) + sum(counts[-1] * 4**split for split in range(1, self._refine + 1))
        finished = None
        with stage("basins", unit=CELLS, total=total):
            for shape in self._shapes[:-1]:
                finished = self._filled(np.full(shape, NOT_FOLLOWED, dtype=np.int16), finished)
            finished = self._filled(self._labels, finished)
            for _ in range(self._refine):
                near = ~agreeing(self._labels, max(1, self._margin or 0))
                self._labels = _split(np.where(near, NOT_FOLLOWED, self._labels).astype(np.int16))
                finished = self._filled(self._labels, finished)

    def _filled(self, labels: Labels, coarser: Basins | None) -> Basins:
        """Follow the cells that are not known yet, some at a time."""
        classifier = self._classifier
        if coarser is not None and self._margin is not None:
            classifier = classifier.sharing(coarser, self._margin)
        places = np.flatnonzero(labels == NOT_FOLLOWED)
        advance(labels.size - len(places))
        for start in range(0, len(places), _CHUNK):
            part = places[start : start + _CHUNK]
            found = np.full(len(part), NOT_FOLLOWED, dtype=np.int64)
            try:
                classifier.label(found, centres(classifier.osc, classifier.region, labels.shape, part))
            finally:
                labels.flat[part] = found
        return Basins(classifier.region, labels)


def _shapes(cells: tuple[int, int]) -> list[tuple[int, int]]:
    """Grids from coarse to fine, halved down to one that is quickly followed."""
    shapes = [cells]
    while math.prod(shapes[-1]) > _COARSEST:
        shapes.append((-(-shapes[-1][0] // 2), -(-shapes[-1][1] // 2)))
    return shapes[::-1]


def _split(labels: Labels) -> Labels:
    return labels.repeat(2, axis=0).repeat(2, axis=1)
