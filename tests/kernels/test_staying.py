"""Staying near an attractor, on sections that are counted by hand."""

import numpy as np
import pytest

from vibrokit.kernels.staying import staying

FRAME = np.array([[0.0, 4.0], [0.0, 1.0]])  # four cells along x: one to enter, that and the next to stay in
ENTERED = np.array([[[True], [False], [False], [False]]])
NEAR = np.array([[[True], [True], [False], [False]]])
IN, BESIDE, AWAY, OUTSIDE = 0.5, 1.5, 2.5, 9.0


def stayed(places, most=4, misses=1, pieces=1):
    """Whether a trajectory at these places of consecutive sections has stayed, watched in one or more calls."""
    kept = np.zeros((2, 1, 1), dtype=np.int64)
    found = -1
    for part in np.array_split(np.array(places), pieces):
        visits = np.stack([part, np.full(len(part), 0.5)], axis=-1)[None]
        got = staying(visits, np.array([len(part)]), FRAME, ENTERED, NEAR, most, misses, *kept)[0]
        found = max(found, got)
    return bool(found == 0)


@pytest.mark.parametrize("pieces", [1, 2, 3])
@pytest.mark.parametrize(
    ("places", "expected"),
    [
        ([IN, BESIDE, BESIDE, IN, BESIDE], True),
        ([IN, BESIDE, BESIDE, IN], False),  # one section too few
        ([BESIDE] * 20, False),  # never entered
        ([AWAY, AWAY, IN, IN, AWAY, IN, IN], True),  # one miss
        ([IN, AWAY, IN, OUTSIDE, IN, IN, IN], False),  # the second miss is one too many, and only three are left
        ([IN, AWAY, IN, OUTSIDE, IN, IN, IN, IN, IN], True),
    ],
)
def test_sections_counted_by_hand(places, expected, pieces):
    assert stayed(places, pieces=pieces) is expected


def test_the_first_attractor_that_is_stayed_near_and_sections_that_were_not_passed():
    visits = np.full((2, 6, 2), 0.5)
    both = np.concatenate([~NEAR, ENTERED]), np.concatenate([~NEAR, NEAR])
    kept = np.zeros((2, 2, 2), dtype=np.int64)
    found = staying(visits, np.array([6, 3]), FRAME, *both, 4, 0, *kept)
    assert found.tolist() == [1, -1]
    assert kept[0].tolist() == [[0, 6], [0, 3]]
