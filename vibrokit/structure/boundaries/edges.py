"""Edge tracking: motions that stay on the boundary between two basins, and whether they have converged.

Two close states that lead to different attractors lie on two sides of the boundary. Mapped forward, and brought
together again whenever they have separated, they follow a motion on the boundary, which converges to an attracting set
within the boundary, usually a saddle (Battelino, Grebogi, Ott, Yorke and Yorke, Physica D 32, 1988). Keeping the change
of label nearest to one end finds sets that are accessible from that basin (Grebogi, Nusse, Ott and Yorke, 1988).
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Container, Mapping

import numpy as np
from numpy.typing import NDArray

from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.results.basins import NOT_FOLLOWED, UNSETTLED, Basins, exits_of
from vibrokit.structure.along_x import shifted, states_at, turn_of, turns_to
from vibrokit.structure.autonomous import PARTS_OF_A_TURN
from vibrokit.structure.basins.classifier import BasinClassifier
from vibrokit.structure.boundaries.meetings import Pair, grouped, meeting_cells, settled, spread
from vibrokit.symbolic.flow_kind import Flow

_TOGETHER = 2e-10  # of the region's widths: distance of two ends that count as together

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class EdgeTrack:
    """A motion on the boundary between two basins, whose labels at its end are given, the lower first.

    Its nodes (parts · (count − 1) + 1, n) are the midpoints between the two sides at all times at which these were
    brought together. Its points (count, n) are those at the sections, of which every sixteenth of 2π/ω_n is one in an
    autonomous scene. Its stretches (count − 1,) are the logarithms of the ratios by which the distance of the two sides
    grows from each point to the next.
    """

    labels: Pair
    nodes: Array
    stretches: Array
    parts: int = 1

    @property
    def points(self) -> Array:
        return self.nodes[:: self.parts]

    def guess(self, period: int) -> Array:
        """Return a guess of an orbit of some period that the motion has converged to, as of `refine_orbit`."""
        return self.points[-1] if self.parts == 1 else self.nodes[-1 - period * self.parts : -1]


@dataclasses.dataclass(frozen=True, eq=False)
class Strip:
    """A strip of states that do not settle between two basins, of which one state (n,) is given.

    A motion next to a weakly unstable orbit leaves it later than the budget allows.
    """

    labels: Pair
    state: Array


class Straddles:
    """Pairs of states on two sides of a boundary, integrated together.

    They start between neighbouring cells of different labels, distributed over the cells where the labels meet, at most
    `trackers` pairs for each pair of labels. `only` are the pairs of labels to start between, the lower first; by
    default all that meet. Pairs without a change of label between them are dropped. Between two sections they are
    brought together `parts` times. Labels that `groups` has, of cells too, are replaced. None are brought together any
    more once classifying states has taken `budget` sections.
    """

    def __init__(
        self,
        classifier: BasinClassifier,
        basins: Basins,
        trackers: int,
        rng: np.random.Generator,
        only: Container[Pair] | None = None,
        parts: int = 1,
        budget: float = math.inf,
        groups: Mapping[int, int] | None = None,
    ) -> None:
        self.classifier, self.rng, self.budget, self.groups = classifier, rng, budget, groups or {}
        self.parts = PARTS_OF_A_TURN if classifier.osc.autonomous else parts
        centres = basins.region.cell_centres(basins.labels.shape)
        lines, origins = [np.empty((0, 2, 2))], [np.empty((0, 2), dtype=np.int64)]
        for pair, cells in meeting_cells(basins, self.groups).items():
            if only is None or pair in only:
                lines.append(spread(centres[cells], trackers, rng))
                origins.append(np.tile(pair, (len(lines[-1]), 1)))
        self.ends = states_at(classifier.osc, np.concatenate(lines))
        self.origins = np.concatenate(origins)  # labels of the cells that each initial pair lies between
        self.end_labels = np.zeros(self.ends.shape[:2], dtype=np.int64)
        self.numbers = np.arange(len(self.ends))  # of each pair among the initial ones
        self.sections = 0  # that classifications took
        self.strips: list[Strip] = []  # that hide the boundary
        self._points: list[Array] = []  # at each section, of all pairs
        self._stretches: list[Array] = []
        self._bring_together(np.arange(len(self.ends)))

    def __len__(self) -> int:
        return len(self.ends)

    @property
    def spent(self) -> bool:
        """Whether the budget is spent."""
        return self.sections >= self.budget

    @property
    def interval(self) -> float:
        """Time from one advance to the next (s)."""
        return self.classifier.osc.section_interval / self.parts

    @property
    def time(self) -> float:
        """Time since the last section; 0 in an autonomous scene (s)."""
        return 0.0 if self.classifier.osc.autonomous else len(self._stretches) % self.parts * self.interval

    @property
    def too_fast(self) -> bool:
        """Whether ends have separated so far between two times that the boundary was lost, and more may help."""
        fastest = max((float(np.max(each, initial=0.0)) for each in self._stretches), default=0.0)
        return fastest > 14.0 and not self.classifier.osc.autonomous and self.parts < 128  # e¹⁴ · 1e-10 = 1e-4 widths

    def advance(self) -> None:
        """Integrate all ends over an interval, and bring those together again that have separated."""
        if not len(self):
            return
        before = self._widths()
        osc, stepper = self.classifier.osc, self.classifier.stepper
        states = self.ends.reshape(-1, self.ends.shape[-1])
        ended = run_ensemble(osc, Flow.STATE, stepper, states, start_time=self.time, interval=self.interval)
        self.ends = ended.states.reshape(self.ends.shape)
        if self.classifier.circle:
            turns = turns_to(osc, self.ends.mean(axis=1), self.classifier.landings.middle)
            self.ends = shifted(self.ends, -turn_of(osc) * turns[:, None])
        after = self._widths()
        with np.errstate(divide="ignore", invalid="ignore"):
            self._stretches.append(np.log(after / before))
        separated = ~(after <= 30 * _TOGETHER)
        if separated.any():  # the others are included: a call takes as long as its longest trajectory
            separated |= after > _TOGETHER
        self._bring_together(np.flatnonzero(separated))

    def keep(self, kept: NDArray[np.bool_]) -> None:
        """Drop the pairs that are not kept."""
        if kept.all():
            return
        self.ends, self.end_labels, self.numbers = self.ends[kept], self.end_labels[kept], self.numbers[kept]
        self._points = [points[kept] for points in self._points]
        self._stretches = [stretches[kept] for stretches in self._stretches]

    def track(self, index: int) -> EdgeTrack:
        """One motion so far."""
        low, high = sorted(int(label) for label in self.end_labels[index])
        nodes = np.array([points[index] for points in self._points])
        stretches = np.array([stretches[index] for stretches in self._stretches])
        parts = 1 if self.classifier.osc.autonomous else self.parts
        whole = len(stretches) // parts * parts  # up to the last section
        return EdgeTrack((low, high), nodes[: whole + 1], stretches[:whole].reshape(-1, parts).sum(axis=1), parts)

    def _bring_together(self, wide: NDArray[np.intp]) -> None:
        """Bring the ends of some pairs together, drop pairs that lost the boundary, and record all points."""
        straddling = np.ones(len(self), dtype=bool)
        for _ in range(60):
            if not wide.size or self.spent:
                break
            shrunk = self._cut(wide)
            straddling[wide[~shrunk]] = False
            wide = wide[shrunk & (self._widths()[wide] > _TOGETHER)]
        straddling[wide] = False
        self.keep(straddling)
        self._points.append(self.ends.mean(axis=1))

    def _cut(self, wide: NDArray[np.intp]) -> NDArray[np.bool_]:
        """Cut lines into pieces and keep of each a piece whose ends differ; return which lines have one."""
        low, high = self.ends[wide, 0], self.ends[wide, 1]
        pieces = int(np.clip(512 // len(wide) - 1, 3, 63))  # about 512 states are classified at once
        corners = low[:, None] + np.linspace(0.0, 1.0, pieces + 1)[:, None] * (high - low)[:, None]
        corners[:, -1] = high
        labels = self._labels(corners.reshape(-1, low.shape[-1])).reshape(corners.shape[:2])
        shrunk = np.zeros(len(wide), dtype=bool)
        for row, index in enumerate(wide):
            known = np.flatnonzero(settled(labels[row]) & np.isfinite(corners[row]).all(axis=1))
            changes = np.flatnonzero(np.diff(labels[row, known]))
            if not changes.size:
                continue
            picked = (0, -1, int(self.rng.integers(changes.size)))[self.numbers[index] % 3]
            piece = known[changes[picked] : changes[picked] + 2]
            self.ends[index], self.end_labels[index] = corners[row, piece], labels[row, piece]
            shrunk[row] = piece[1] - piece[0] < pieces
            if not shrunk[row] and self.time == 0 and (labels[row, 1:-1] == UNSETTLED).all():
                ends = sorted(int(label) for label in labels[row, piece])
                self.strips.append(Strip((ends[0], ends[1]), corners[row, pieces // 2]))
        return shrunk

    def _labels(self, states: Array) -> NDArray[np.int64]:
        found = np.full(len(states), NOT_FOLLOWED, dtype=np.int64)
        self.sections += self.classifier.label(found, states, self.time)
        return grouped(exits_of(found), self.groups)

    def _widths(self) -> Array:
        return self.classifier.region.apart(self.ends[:, 1], self.ends[:, 0])
