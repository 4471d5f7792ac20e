"""Motion until it arrives at an attractor, and which one that is, where states a turn apart have the same motion."""

from __future__ import annotations

import concurrent.futures
import dataclasses
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from vibrokit.kernels.ensemble import Ensemble, Stop, run_ensemble
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.stopping import COMPLETED, REACHED
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.results.basins import AT_COPY, UNSETTLED, Basins
from vibrokit.results.region import Region
from vibrokit.structure.along_x import shifted, turn_of, turns_to, wrapped
from vibrokit.symbolic.flow_kind import Flow

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
            if here.shape == there.shape and self.region.apart(here, there).max() < 1e-6:
                return other
        return label

    def samples(self, points: Sequence[Array]) -> Iterator[tuple[int, Array]]:
        """Yield labels and points (…, 2) of each attractor given by some of its points, and of its copies.

        The labels go on from those of the attractors where x repeats.
        """
        turn, half = turn_of(self.osc), 0.55 * turn_of(self.osc)  # a little beyond the turn
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
    chunk = max(1, 2**20 // max(1, len(stop.points)))
    for first in range(0, len(states) if len(stop.points) else 0, chunk):
        part = slice(first, first + chunk)
        offsets = states[part, None, :2] - stop.points
        apart = np.linalg.norm(np.einsum("mij,kmj->kmi", stop.metrics, offsets), axis=2)
        nearest = apart.argmin(axis=1)
        reached = apart.min(axis=1) <= 1.0
        found[part][reached] = stop.point_labels[nearest[reached]]
    return found


def followed(
    osc: Oscillator,
    stepper: Stepper,
    states: Array,
    sections: int | Whole,
    stop: Stop,
    *,
    middle: float = 0.0,
    visits: int = 0,
    executor: concurrent.futures.Executor | None = None,
) -> tuple[Ensemble, Whole]:
    """Integrate states (count, n) until they arrive, or over some sections; return also how many turns they moved by.

    Where x repeats, that is over one section, and motion is moved back to the turn around a place.
    """
    if not (turn := turn_of(osc)):
        ended = run_ensemble(osc, Flow.STATE, stepper, states, sections, stop=stop, visits=visits, executor=executor)
        return ended, np.zeros(len(states), dtype=np.int64)
    ended = run_ensemble(osc, Flow.STATE, stepper, states, visits=1, executor=executor)
    turns = turns_to(osc, ended.states, middle)
    here, visited = shifted(ended.states, -turn * turns), shifted(ended.visits, -turn * turns[:, None])
    label = np.where(ended.status == COMPLETED, landed(stop, here), UNSETTLED)
    status = np.where(label >= 0, REACHED, ended.status)
    ended = dataclasses.replace(ended, states=here, visits=visited, label=label, status=status)
    return ended, turns.astype(np.int64)
