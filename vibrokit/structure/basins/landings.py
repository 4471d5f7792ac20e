"""Attractors and their copies whole turns away along x, and motion until it arrives at one of them."""

from __future__ import annotations

import concurrent.futures
import dataclasses
import math
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
from vibrokit.results.saddle import Saddle
from vibrokit.structure.along_x import shifted, turn_of, turns_to, wrapped
from vibrokit.structure.scales import units_of
from vibrokit.symbolic.flow_kind import Flow

Array = NDArray[np.float64]
Whole = NDArray[np.int64]


def without_copies(osc: Oscillator, attractors: Sequence[Attractor]) -> list[Attractor]:
    """Return attractors of which none is another one moved along x by whole turns; those nearest to x = 0."""
    kept = list[Attractor]()
    for one in sorted(attractors, key=lambda each: abs(float(each.points[:, 0].mean()))):
        if not any(_is_copy(osc, one, other) for other in kept):
            kept.append(one)
    return kept


def _is_copy(osc: Oscillator, one: Attractor, other: Attractor) -> bool:
    if not turn_of(osc) or one.points.shape != other.points.shape:
        return False
    return bool(np.all(np.abs(wrapped(osc, one.points - other.points)) < 1e-6 * units_of(osc)))


def copies_in(osc: Oscillator, attractors: Sequence[Attractor], region: Region, *, one_each: bool) -> list[Attractor]:
    """Return each attractor in the turn around the middle of a region, or once for each turn in which it is there.

    Motion that turns over, and motion that never repeats, is one attractor however often it is met.
    """
    turn = turn_of(osc)
    if not turn:
        return list(attractors)
    middle, found = float(np.mean(region.x)), list[Attractor]()
    most = 0 if one_each else math.ceil(region.widths[0] / turn)
    for one in without_copies(osc, attractors):
        anywhere = bool(one.turns) or not one.repeats
        nearest = _moved(one, -turn * float(turns_to(osc, one.points[:1], middle)[0]))
        moved = [_moved(nearest, turn * away) for away in range(-most, most + 1)]
        found += [nearest] if anywhere else [each for each in moved if lies_in(region, each)] or [nearest]
    return found


def _moved(one: Attractor, distance: float) -> Attractor:
    """Return an attractor moved along x."""
    return dataclasses.replace(one, points=shifted(one.points, distance), orbit=shifted(one.orbit, distance))


def on_circle(osc: Oscillator, attractors: Sequence[Attractor], region: Region | None) -> bool:
    """Whether states a turn apart along x count as one: motion turns over, and the region is one turn or none."""
    turn = turn_of(osc)
    narrow = region is None or region.widths[0] <= turn * (1 + 1e-6)
    return bool(turn) and narrow and any(each.turns for each in attractors)


def lies_in(region: Region, orbit: Attractor | Saddle) -> bool:
    """Whether some point of an orbit on the section is in a region; of a limit cycle, whether any of its points is."""
    points = orbit.orbit if isinstance(orbit, Attractor) and orbit.kind == "limit cycle" else orbit.points
    return bool(region.contains(points).any())


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
        self._first = [  # of the copies of each
            next((n for n, other in enumerate(attractors[:label]) if _is_copy(osc, one, other)), label)
            for label, one in enumerate(attractors)
        ]
        self._at = {(self._first[label], home): label for label, home in reversed(self.entries)}

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
