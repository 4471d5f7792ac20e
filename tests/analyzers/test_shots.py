"""Shots, with a shooter that knows beforehand which paths are exits."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from vibrokit.analyzers.shooting.boxes import Boxes
from vibrokit.analyzers.shooting.outcomes import Outcomes
from vibrokit.analyzers.shooting.shots import Shots
from vibrokit.kernels.stopping import COMPLETED, LEFT_BASIN


@dataclasses.dataclass
class Shooter:
    """One attractor to reach; `exits` says which paths lead there."""

    exits: np.ndarray
    settled: int = 0

    def doubtful(self, outcomes, factor):
        least = np.where(outcomes.confirmed, outcomes.actions, np.inf).min()
        below = outcomes.actions < factor * least
        return np.flatnonzero((outcomes.status == LEFT_BASIN) & ~outcomes.confirmed & below)

    def settle(self, outcomes, which):
        self.settled += len(which)
        outcomes.confirmed[which] = self.exits[which]
        outcomes.status[which[~self.exits[which]]] = COMPLETED


def shots(share, seed):
    """Paths whose actions have two valleys; a share of them, chosen at random, are no exits."""
    boxes = Boxes.grid((60, 30))
    places, generator = boxes.centres, np.random.default_rng(seed)
    actions = 1 + np.minimum(*(np.hypot(*(places - at).T) + more for at, more in (((0.3, 0.4), 0), ((0.7, 0.6), 0.1))))
    count = len(places)
    states = np.zeros((count, 5))
    states[:, -1] = actions
    whole = np.zeros(count, dtype=np.int64)
    outcomes = Outcomes(
        states, whole, states, whole + LEFT_BASIN, whole, whole, np.zeros(count, dtype=bool), whole.copy()
    )
    shooter = Shooter(generator.random(count) > share)
    return Shots(SimpleNamespace(patience=3), shooter, boxes, outcomes, ())


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9])
@pytest.mark.parametrize("seed", range(3))
def test_minima_are_exits_and_the_rest_is_not_settled(share, seed):
    given = shots(share, seed)
    exits = given.shooter.exits
    every = given.boxes.minima(np.where(exits, given.outcomes.actions, np.inf))
    found = given.minima(64)
    assert given.outcomes.confirmed[found].all()
    assert exits[found].all()
    assert set(found) <= set(every)
    assert found[0] == every[0]
    assert (np.diff(given.outcomes.actions[found]) >= 0).all()
    assert given.shooter.settled < len(exits) / 2


def test_at_most_so_many_minima():
    assert len(shots(0.0, 0).minima(1)) == 1
