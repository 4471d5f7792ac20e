"""Which attractor motion has come to, where states a turn along x apart have the same motion."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from vibrokit.kernels.ensemble import Stop
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.results.basins import AT_COPY, UNSETTLED, Basins
from vibrokit.results.region import Region
from vibrokit.structure.circle import shifted, turn_of, turns_to, wrapped

_BORDER = 0.05  # of a turn, beyond it on both sides: where samples of attractors are kept
_SAME = 1e-6  # of the region's widths: distance of two attractors that are copies of each other
_AT_ONCE = 2**20  # distances of states from points

Array = NDArray[np.float64]
Whole = NDArray[np.int64]


class Landings:
    """The attractors as motion meets them that is moved back by whole turns to the middle of a region.

    Each has an entry for itself where it lies, which the labels of cells are, and entries for its copies in that turn
    and the two beside it. On the line, motion may come to a copy that is no known attractor (AT_COPY); on the circle,
    all copies of an attractor are one. Motion that turns over, and motion that never repeats, is the same
    attractor wherever it is met.
    """

    def __init__(self, osc: Oscillator, attractors: Sequence[Attractor], region: Region, *, circle: bool) -> None:
        self.osc, self.attractors, self.region, self.circle = osc, attractors, region, circle
        self.middle = float(np.mean(region.x))
        homes = [int(turns_to(osc, each.points[:1], self.middle)[0]) for each in attractors]
        self.entries = list(enumerate(homes))  # of each label: which attractor, and how many turns away
        self._first = [self._copy_of(label) for label in range(len(attractors))]
        self._at = {(self._first[label], home): label for label, home in reversed(self.entries)}

    def _copy_of(self, label: int) -> int:
        """The first attractor of which one is a copy."""
        here = self._wrapped(self.attractors[label].points)
        for other in range(label if turn_of(self.osc) else 0):
            there = self._wrapped(self.attractors[other].points)
            if here.shape == there.shape and self.region.apart(here, there).max() < _SAME:
                return other
        return label

    def samples(self, points: Sequence[Array]) -> Iterator[tuple[int, Array]]:
        """Yield labels and points (…, 2) of each attractor given by some of its points, and of its copies.

        The labels go on from those of the attractors where x repeats.
        """
        turn, half = turn_of(self.osc), (0.5 + _BORDER) * turn_of(self.osc)
        if not turn:
            yield from enumerate(points)
            return
        self.entries = self.entries[: len(self.attractors)]
        for label, own in enumerate(points):
            copies = np.stack([shifted(self._wrapped(own), turn * away) for away in (-1, 0, 1)], axis=1)
            groups = (
                [copies.reshape(-1, copies.shape[-1])] if self._anywhere(label) else list(np.moveaxis(copies, 1, 0))
            )
            for away, group in zip((-1, 0, 1), groups, strict=False):
                self.entries.append((label, away))
                kept = group[np.abs(group[:, 0] - self.middle) <= half]
                if len(kept):
                    yield len(self.entries) - 1, kept

    def attractor(self, label: int) -> Attractor:
        """Return the attractor that a label of `samples` stands for."""
        return self.attractors[self.entries[label][0]]

    def labels(self, found: Whole, turns: Whole) -> Whole:
        """Return the attractors of entries that motion met, after it was moved back by some turns; else AT_COPY."""
        pairs, places = np.unique(np.stack([found, turns], axis=1), axis=0, return_inverse=True)
        each = np.array([self._label(*pair) for pair in pairs.tolist()], dtype=np.int64)
        return each[places.reshape(-1)] if len(found) else found

    def _label(self, entry: int, turns: int) -> int:
        label, away = self.entries[entry]
        if not turn_of(self.osc) or self._anywhere(label):
            return label
        return self._first[label] if self.circle else self._at.get((self._first[label], away + turns), AT_COPY)

    def _anywhere(self, label: int) -> bool:
        return self.attractors[label].turns != 0 or not self.attractors[label].repeats

    def _wrapped(self, points: Array) -> Array:
        return wrapped(self.osc, points[:, :2], self.middle)


def landed(stop: Stop, states: Array) -> Whole:
    """Return the labels of the points or cells of a test that states (count, n) are at; UNSETTLED for none."""
    found = np.full(len(states), UNSETTLED, dtype=np.int64)
    if stop.labels.size:
        found = Basins(Region.of(stop.area), stop.labels).at(states[:, :2]).astype(np.int64)
        found[found < 0] = UNSETTLED
    chunk = max(1, _AT_ONCE // max(1, len(stop.points)))
    for first in range(0, len(states) if len(stop.points) else 0, chunk):
        part = slice(first, first + chunk)
        offsets = states[part, None, :2] - stop.points
        apart = np.linalg.norm(np.einsum("mij,kmj->kmi", stop.metrics, offsets), axis=2)
        nearest = apart.argmin(axis=1)
        reached = apart.min(axis=1) <= 1.0
        found[part][reached] = stop.point_labels[nearest[reached]]
    return found
