"""Edge tracking: motions that stay on the boundary between two basins.

Two close states that lead to different attractors lie on two sides of the boundary. Mapped forward, and brought
together again whenever they have separated, they follow a motion on the boundary, which converges to an attracting set
within the boundary, usually a saddle (Battelino, Grebogi, Ott, Yorke and Yorke, Physica D 32, 1988). Keeping the change
of label nearest to one end finds sets that are accessible from that basin (Grebogi, Nusse, Ott and Yorke, 1988).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Container
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.results.basins import LEFT, Basins
from vibrokit.structure.regions import states_at
from vibrokit.symbolic.flow_kind import Flow

PARTS_OF_A_TURN = 16
"""Points for each 2π/ω_n in an autonomous scene, where any time step is a section."""
_WIDTH = 1e-10  # of the region's size: target distance of two ends
_SEPARATED, _TOGETHER = 60.0, 2.0  # times that: distances at which ends are brought together, and count as together
_FEWEST_PIECES, _MOST_PIECES = 3, 63  # of a line between two ends, all corners classified at once
_AT_ONCE = 512  # states to classify, about: fewer take as long
_MOST_CUTS = 60
_FIRST, _LAST = 0, 1  # which change of label on the line is kept, from the lower label; the third choice is random

Array = NDArray[np.float64]
Labels = NDArray[np.int64]


class Classifier(Protocol):
    """What edge tracking needs of a `BasinClassifier`."""

    @property
    def osc(self) -> Oscillator:
        """The scene."""

    @property
    def stepper(self) -> Stepper:
        """Integrates the states."""

    def labels(self, states: Array) -> Labels:
        """Label of the attractor that each state leads to."""


@dataclasses.dataclass(frozen=True, eq=False)
class EdgeTrack:
    """A motion on the boundary between two basins.

    Attributes
    ----------
    labels : (int, int)
        Labels of the two sides at its end, the lower first.
    points : array (count, n)
        Midpoints between the two sides, at every section; at every sixteenth of 2π/ω_n in an autonomous scene.
    stretches : array (count − 1,)
        Logarithm of the ratio by which the distance of the two sides grows from each point to the next.
    """

    labels: tuple[int, int]
    points: Array
    stretches: Array


def edge_states(
    classifier: Classifier, basins: Basins, *, trackers: int = 16, sections: int = 64, rng: np.random.Generator
) -> list[EdgeTrack]:
    """Follow motions on the boundaries between the basins of a grid.

    Parameters
    ----------
    classifier : BasinClassifier
    basins : Basins
        Motions start between neighbouring cells of different labels.
    trackers : int
        Largest number of motions for each pair of labels that meet, distributed over the cells where they do.
    sections : int
        Length of each motion.
    rng : numpy.random.Generator
        Chooses the cells, and the change of label that is kept if there are several.

    Returns
    -------
    list of EdgeTrack
        Without motions that lost the boundary.
    """
    straddles = Straddles.across(classifier, basins, trackers, rng)
    for _ in range(sections):
        straddles.advance()
    return straddles.tracks()


class Straddles:
    """Pairs of states on two sides of a boundary, integrated together.

    Attributes
    ----------
    ends : array (count, 2, n)
    end_labels : int array (count, 2)
    numbers : int array (count,)
        Index of each pair among the initial ones.
    origins : int array (initial pairs, 2)
        Labels of the cells that each initial pair lies between.
    lost : int
        Number of pairs that lost the boundary and were dropped.
    """

    def __init__(
        self, classifier: Classifier, ends: Array, origins: Labels, width: float, rng: np.random.Generator
    ) -> None:
        """Bring the ends of each line together around a change of label on it; drop lines without one."""
        self.classifier = classifier
        self.width = width
        self.rng = rng
        self.ends = ends
        self.end_labels = np.zeros(ends.shape[:2], dtype=np.int64)
        self.numbers = np.arange(len(ends))
        self.origins = origins
        self.lost = 0
        self._history: list[list[Array]] = [[] for _ in ends]
        self._stretches: list[list[float]] = [[] for _ in ends]
        self._bring_together(np.arange(len(ends)))

    @classmethod
    def across(
        cls,
        classifier: Classifier,
        basins: Basins,
        trackers: int,
        rng: np.random.Generator,
        only: Container[tuple[int, int]] | None = None,
    ) -> Straddles:
        """Start between neighbouring cells of different labels, at most `trackers` pairs for each pair of labels.

        Parameters
        ----------
        classifier, basins, trackers, rng
            As for `edge_states`.
        only : collection of (int, int), optional
            Pairs of labels to start between, the lower first; by default all that meet.
        """
        centres = basins.region.cell_centres(basins.labels.shape)
        lines, origins = [np.empty((0, 2, 2))], [np.empty((0, 2), dtype=np.int64)]
        for pair, cells in meeting_cells(basins).items():
            if only is None or pair in only:
                lines.append(spread(centres[cells], trackers, rng))
                origins.append(np.tile(pair, (len(lines[-1]), 1)))
        ends = states_at(classifier.osc, np.concatenate(lines))
        width = _WIDTH * basins.region.size
        return cls(classifier, ends, np.concatenate(origins), width, rng)

    def __len__(self) -> int:
        return len(self.ends)

    @property
    def interval(self) -> float:
        """Time from one point to the next (s)."""
        osc = self.classifier.osc
        return osc.section_interval / (PARTS_OF_A_TURN if osc.autonomous else 1)

    def advance(self) -> None:
        """Map all ends to the next section, and bring those together again that have separated."""
        if not len(self):
            return
        count, _, size = self.ends.shape
        before = self._widths()
        osc, stepper = self.classifier.osc, self.classifier.stepper
        states = self.ends.reshape(-1, size)
        self.ends = run_ensemble(osc, Flow.STATE, stepper, states, interval=self.interval).states.reshape(
            count, 2, size
        )
        after = self._widths()
        with np.errstate(divide="ignore", invalid="ignore"):
            grown = np.log(after / before)
        for stretches, stretch in zip(self._stretches, grown, strict=True):
            stretches.append(float(stretch))
        separated = ~(after <= _SEPARATED * self.width)
        if separated.any():  # the others come along: a call takes as long as its longest trajectory
            separated |= after > _TOGETHER * self.width
        self._bring_together(np.flatnonzero(separated))

    def history(self, index: int) -> Array:
        """Points of one motion so far, shape (count, n)."""
        return np.array(self._history[index])

    def keep(self, kept: NDArray[np.bool_]) -> None:
        """Drop the pairs that are not kept."""
        self.ends, self.end_labels, self.numbers = self.ends[kept], self.end_labels[kept], self.numbers[kept]
        self._history = [history for history, wanted in zip(self._history, kept, strict=True) if wanted]
        self._stretches = [stretches for stretches, wanted in zip(self._stretches, kept, strict=True) if wanted]

    def tracks(self) -> list[EdgeTrack]:
        """The motions so far."""
        return [self.track(index) for index in range(len(self))]

    def track(self, index: int) -> EdgeTrack:
        """One motion so far."""
        low, high = sorted(int(label) for label in self.end_labels[index])
        return EdgeTrack((low, high), self.history(index), np.array(self._stretches[index]))

    def _bring_together(self, wide: NDArray[np.intp]) -> None:
        """Bring the ends of some pairs together, drop pairs on one side of the boundary, and record all places."""
        straddling = np.ones(len(self), dtype=bool)
        for _ in range(_MOST_CUTS):
            if not wide.size:
                break
            shrunk = self._cut(wide)
            straddling[wide[~shrunk]] = False
            wide = wide[shrunk & (self._widths()[wide] > _TOGETHER * self.width)]
        straddling[wide] = False
        self.lost += int(np.sum(~straddling))
        self.keep(straddling)
        for history, point in zip(self._history, self.ends.mean(axis=1), strict=True):
            history.append(point)

    def _cut(self, wide: NDArray[np.intp]) -> NDArray[np.bool_]:
        """Cut lines into pieces and keep of each a piece whose ends differ; return which lines have one."""
        low, high = self.ends[wide, 0], self.ends[wide, 1]
        pieces = int(np.clip(_AT_ONCE // len(wide) - 1, _FEWEST_PIECES, _MOST_PIECES))
        shares = np.linspace(0.0, 1.0, pieces + 1)[:, None]
        corners = low[:, None] + shares * (high - low)[:, None]
        corners[:, -1] = high
        labels = self.classifier.labels(corners.reshape(-1, low.shape[-1])).reshape(corners.shape[:2])
        shrunk = np.zeros(len(wide), dtype=bool)
        for row, index in enumerate(wide):
            known = np.flatnonzero(settled(labels[row]) & np.isfinite(corners[row]).all(axis=1))
            changes = np.flatnonzero(np.diff(labels[row, known]))
            if not changes.size:
                continue
            picked = {_FIRST: 0, _LAST: -1}.get(int(self.numbers[index] % 3), int(self.rng.integers(changes.size)))
            piece = known[changes[picked] : changes[picked] + 2]
            self.ends[index], self.end_labels[index] = corners[row, piece], labels[row, piece]
            shrunk[row] = piece[1] - piece[0] < pieces
        return shrunk

    def _widths(self) -> Array:
        return np.linalg.norm(self.ends[:, 1] - self.ends[:, 0], axis=1)


def settled(labels: NDArray[np.integer]) -> NDArray[np.bool_]:
    """Whether labels are those of states that lead to an attractor, or leave the region for good."""
    return (labels >= 0) | (labels == LEFT)


def meeting_cells(basins: Basins) -> dict[tuple[int, int], NDArray[np.intp]]:
    """Return, for each pair of labels that meet, the flat indices of the cells on both sides, shape (count, 2).

    The lower label is first. Cells that did not settle are skipped; only the nearest meetings of a pair are returned.
    """
    numbers = np.arange(basins.labels.size).reshape(basins.labels.shape)
    meetings: dict[tuple[int, int], list[tuple[int, int, int]]] = {}
    for labels, cells in ((basins.labels, numbers), (basins.labels.T, numbers.T)):
        for row, cell in zip(labels, cells, strict=True):
            known = np.flatnonzero(settled(row))
            for change in np.flatnonzero(np.diff(row[known])):
                here, there = known[change], known[change + 1]
                away = there - here
                if row[here] > row[there]:
                    here, there = there, here
                pair = int(row[here]), int(row[there])
                meetings.setdefault(pair, []).append((away, cell[here], cell[there]))
    nearest = {}
    for pair, rows in sorted(meetings.items()):
        found = np.array(rows)
        nearest[pair] = found[found[:, 0] == found[:, 0].min(), 1:]
    return nearest


def spread(lines: Array, most: int, rng: np.random.Generator) -> Array:
    """Pick at most so many lines (count, 2, 2): a random first one, then each as far from those picked as possible."""
    middles = lines.mean(axis=1)
    middles = middles / np.maximum(np.ptp(middles, axis=0), np.finfo(float).tiny)
    picked = [int(rng.integers(len(lines)))]
    distance = np.full(len(lines), np.inf)
    while len(picked) < min(most, len(lines)):
        distance = np.minimum(distance, np.linalg.norm(middles - middles[picked[-1]], axis=1))
        picked.append(int(np.argmax(distance)))
    return lines[picked]
