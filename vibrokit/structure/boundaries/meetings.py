"""Meetings: which basins touch on a grid and where, and groups of basins that saddles connect."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from vibrokit.results.basins import ESCAPED, Basins
from vibrokit.results.saddle import Saddle

Array = NDArray[np.float64]
Pair = tuple[int, int]
"""Labels of two basins, the lower first."""
Whole = TypeVar("Whole", bound=np.integer)


def grouped(labels: NDArray[Whole], groups: Mapping[int, int]) -> NDArray[Whole]:
    """Replace labels by those of their groups."""
    found = labels.copy()
    for label, group in groups.items():
        found[labels == label] = group
    return found


def settled(labels: NDArray[np.integer]) -> NDArray[np.bool_]:
    """Whether labels are those of states that lead to an attractor, or escape."""
    return (labels >= 0) | (labels == ESCAPED)


def meeting_cells(basins: Basins, groups: Mapping[int, int] | None = None) -> dict[tuple[int, int], NDArray[np.intp]]:
    """Return, for each pair of labels that meet, the flat indices of the cells on both sides, shape (count, 2).

    The lower label is first. Labels that `groups` has are replaced. Cells that did not settle are skipped; only the
    nearest meetings of a pair are returned.
    """
    numbers = np.arange(basins.labels.size).reshape(basins.labels.shape)
    meetings: dict[tuple[int, int], list[tuple[int, int, int]]] = {}
    every = grouped(basins.exits, groups or {})
    for labels, cells in ((every, numbers), (every.T, numbers.T)):
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


def groups_of(saddles: Iterable[Saddle]) -> dict[int, int]:
    """Return, for each label of basins that saddles connect with others, the highest label of all of these."""
    groups: dict[int, int] = {}
    for saddle in saddles:
        joined = {groups.get(label, label) for label in saddle.leads_to}
        for label in [*saddle.leads_to, *(label for label, group in groups.items() if group in joined)]:
            groups[label] = max(joined)
    return groups


def pairs_apart(pairs: Iterable[Pair], groups: Mapping[int, int]) -> set[Pair]:
    """Return the pairs of groups that meet, at least one of which has several basins."""
    large = set(groups.values())
    both = ((groups.get(first, first), groups.get(second, second)) for first, second in pairs)
    return {(min(pair), max(pair)) for pair in both if pair[0] != pair[1] and not large.isdisjoint(pair)}


def first_few(labels: NDArray[np.int64], most: int) -> NDArray[np.bool_]:
    """Keep a few motions for each pair of labels."""
    seen: defaultdict[tuple[int, ...], int] = defaultdict(int)
    kept = np.zeros(len(labels), dtype=bool)
    for index, pair in enumerate(np.sort(labels, axis=1).tolist()):
        seen[tuple(pair)] += 1
        kept[index] = seen[tuple(pair)] <= most
    return kept
