"""Boxes: a search that splits boxes of a unit cube where values are small, or border on small ones.

The search follows DIRECT (Jones, Perttunen & Stuckman, J. Optim. Theory Appl. 79, 157, 1993): a box is known by the
value at its centre; it is split in three along each side, so that its centre remains a centre; boxes of every size are
split in each round, so that no part of the cube is neglected. It differs in three points: many boxes of each size are
split at once, a box ranks as its best neighbour does, and jumps between neighbours are followed, because the least
actions lie there.
"""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from vibrokit.analyzers.shooting.tolerances import TOLERANCES

FINEST = 26
"""Most splits of a box: 3^−26 of a side is at the level of rounding."""

_ROUNDING = 1e-12

Array = NDArray[np.float64]
Whole = NDArray[np.int64]


@dataclasses.dataclass(frozen=True, eq=False)
class Boxes:
    """Boxes that cover the unit cube without overlap; the first coordinate is periodic."""

    centres: Array  # (count, d)
    splits: Whole  # (count,): number of times that each was split
    first: Array  # (d,): sides of a box that was never split

    @classmethod
    def grid(cls, counts: tuple[int, ...]) -> Boxes:
        """Make equal boxes, `counts` of them along each side."""
        axes = [(np.arange(count) + 0.5) / count for count in counts]
        centres = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(counts))
        return cls(centres, np.zeros(len(centres), dtype=np.int64), 1 / np.array(counts))

    def around(self, index: int) -> Boxes:
        """Return some hundred unsplit boxes that cover the first grid's box around a centre, and its neighbours."""
        size = len(self.first)
        count = {1: 200, 2: 25}.get(size, 7)  # along each side, so that few dimensions are resolved well
        centres = self.centres[index] + 3 * self.first * (Boxes.grid((count,) * size).centres - 0.5)
        centres[:, 0] %= 1.0
        centres[:, 1:] = np.clip(centres[:, 1:], 0.0, 1.0 - _ROUNDING)
        return Boxes(centres, np.zeros(len(centres), dtype=np.int64), 3 * self.first / count)

    def split(self, which: Whole) -> Boxes:
        """Split some boxes; each keeps its place with a third of its sides, and the new ones come last."""
        size = self.centres.shape[1]
        steps = np.array([step for step in itertools.product((-1, 0, 1), repeat=size) if any(step)])
        splits = self.splits.copy()
        splits[which] += 1
        sides = self.first * 3.0 ** -splits[which][:, None]
        new = (self.centres[which, None, :] + steps * sides[:, None, :]).reshape(-1, size)
        new[:, 1:] = np.clip(new[:, 1:], 0.0, 1.0 - _ROUNDING)  # only rounding, or `around`, leads outside
        return Boxes(
            np.concatenate([self.centres, new]), np.append(splits, splits[which].repeat(len(steps))), self.first
        )

    def promising(self, values: Array, kinds: Whole, count: int) -> Whole:
        """Return about `count` boxes to split: of each size, those with the least values in their neighbourhoods.

        Half of them are taken where neighbours differ in kind or by a jump in value, because nothing else reveals a
        narrow exit path between two plateaus. Values (boxes,) are infinite where nothing is known.
        """
        near = nearest(self.centres, self.first)
        reachable, highest = values[near].min(axis=1), values[near].max(axis=1)
        jumps = (highest > TOLERANCES.jump * reachable) | (kinds[near] != kinds[:, None]).any(axis=1)
        eligible = np.isfinite(reachable) & (self.splits < FINEST)
        sizes = np.unique(self.splits[eligible])
        chosen = []
        for splits in sizes:
            here = np.flatnonzero(eligible & (self.splits == splits))
            ranked = here[np.lexsort((values[here], reachable[here]))]
            quota = max(2, count // len(sizes))
            chosen += [ranked[: quota // 2], ranked[jumps[ranked]][: quota // 2]]
        return np.unique(np.concatenate(chosen)) if chosen else np.empty(0, dtype=np.int64)

    def minima(self, values: Array) -> Whole:
        """Return the best box in each first-grid box that has no better neighbour, the best first."""
        ranked = np.lexsort((np.arange(len(values)), values))
        cell = np.floor(self.centres / self.first * (1 - _ROUNDING)).astype(np.int64)
        _, first = np.unique(cell[ranked], axis=0, return_index=True)
        best = ranked[first]
        middles = (cell[best] + 0.5) * self.first
        around = values[best][nearest(middles, self.first)].min(axis=1)
        which = best[np.isfinite(values[best]) & (values[best] <= around)]
        return which[np.argsort(values[which], kind="stable")]


def nearest(centres: Array, first: Array) -> Whole:
    """Return the 3^d places nearest to each, in units of `first`; the first coordinate has period 1."""
    scaled = centres / first
    around = np.zeros(len(first))
    around[0] = 1 / first[0]
    scaled[:, 0] %= around[0]
    scaled[:, 0] = np.where(scaled[:, 0] < around[0], scaled[:, 0], 0.0)  # the remainder may round up
    _, near = cKDTree(scaled, boxsize=around).query(scaled, k=min(3 ** len(first), len(scaled)), workers=-1)
    return np.reshape(near, (len(scaled), -1))
