"""Clouds of points: which are of one attractor, and of how many bands it consists."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

_CHUNK = 64
_MOST_OF = 0.5  # share of a sample that must lie near another for both to be of one attractor

Array = NDArray[np.float64]


def separate(samples: list[Array], tolerance: float) -> list[NDArray[np.int64]]:
    """Group samples of motion by the attractor that they are of: those that overlap are of one.

    Two samples overlap if more than half the points of either lie within the tolerance of the other; groups that a
    sample overlaps with both are one.

    Parameters
    ----------
    samples : list of array (count, n)
        Points of the section along one trajectory each, enough of them to be within the tolerance of one another.
    tolerance : float
        Distance in (x, v).

    Returns
    -------
    list of int64 array
        Indices of the samples of each group, the largest group first.
    """
    groups: list[tuple[list[int], cKDTree]] = []
    for index, sample in enumerate(samples):
        places = np.asarray(sample, dtype=float)[:, :2]
        tree = cKDTree(places)
        met = [group for group in groups if _overlap(tree, group[1], tolerance)]
        apart = [group for group in groups if not any(group is other for other in met)]
        members = [index, *(member for group in met for member in group[0])]
        together = cKDTree(np.concatenate([places, *(group[1].data for group in met)])) if met else tree
        groups = [*apart, (members, together)]
    found = [np.array(sorted(members), dtype=np.int64) for members, _ in groups]
    return sorted(found, key=lambda members: (-len(members), int(members[0])))


def _overlap(one: cKDTree, other: cKDTree, tolerance: float) -> bool:
    near = (np.isfinite(a.query(b.data, distance_upper_bound=tolerance)[0]) for a, b in ((one, other), (other, one)))
    return any(float(np.mean(close)) > _MOST_OF for close in near)


def pieces(sample: Array, tolerance: float) -> int:
    """Count the bands that an attractor consists of and visits in turn.

    Points of one trajectory that are close together are then a multiple of that number of sections apart, so it is the
    greatest common divisor of such distances in time.

    Parameters
    ----------
    sample : array (count, n)
        Successive points of one trajectory on the section.
    tolerance : float
        Distance in (x, v) below which points are of one band: less than the gap between two bands, and more than the
        distance to the next point inside one.

    Returns
    -------
    int
        1 if the attractor is connected; 0 if half the points or more have no other so close, which says nothing.
    """
    places = np.asarray(sample, dtype=float)[:, :2]
    tree = cKDTree(places)
    common, met = 0, 0
    for start in range(0, len(places), _CHUNK):
        chunk = np.arange(start, min(start + _CHUNK, len(places)))
        near = tree.query_ball_point(places[chunk], tolerance)
        met += sum(len(indices) > 1 for indices in near)  # each point is among its own
        for index, indices in zip(chunk, near, strict=True):
            common = int(np.gcd.reduce([common, *(np.array(indices) - index)]))
        if common == 1:
            return 1
    return common if met > _MOST_OF * len(places) else 0
