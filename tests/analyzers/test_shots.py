"""Confirmation of exits, with a shooter that knows beforehand which paths are exits."""

from types import SimpleNamespace

import numpy as np
import pytest

from vibrokit.analyzers.shooting.outcomes import Outcomes, Shooter
from vibrokit.kernels.stopping import COMPLETED, LEFT_BASIN

COUNT = 5000


class Knowing(Shooter):
    """Settles paths by what is known of them, and counts them."""

    exits = np.empty(0, dtype=bool)
    settled = 0

    def _settle(self, outcomes, which):
        object.__setattr__(self, "settled", self.settled + len(which))
        outcomes.confirmed[which] = self.exits[which]
        outcomes.status[which[~self.exits[which]]] = COMPLETED


def confirmed(share, seed, factor):
    """Actions from 1 to 10; a share of the paths, chosen at random, are no exits."""
    generator = np.random.default_rng(seed)
    states = np.zeros((COUNT, 5))
    states[:, -1] = generator.uniform(1.0, 10.0, COUNT)
    whole = np.zeros(COUNT, dtype=np.int64)
    unknown = np.zeros(COUNT, dtype=bool)
    outcomes = Outcomes(states, whole, states, whole + LEFT_BASIN, whole, whole, unknown, whole.copy())
    problem = SimpleNamespace(exit=SimpleNamespace(by_position=False), structure=SimpleNamespace(attractors=[None]))
    shooter = Knowing(problem, None, 0)
    object.__setattr__(shooter, "exits", generator.random(COUNT) > share)
    shooter.confirm(outcomes, factor)
    return shooter, outcomes


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9])
@pytest.mark.parametrize("factor", [1.0, 1.5])
def test_exits_up_to_a_factor_are_confirmed_and_few_others_settle(share, factor):
    shooter, outcomes = confirmed(share, 0, factor)
    least = outcomes.actions[shooter.exits].min()
    wanted = shooter.exits & ((outcomes.actions < factor * least) | (outcomes.actions == least))
    assert outcomes.confirmed[wanted].all()
    assert shooter.exits[outcomes.confirmed].all()
    assert shooter.settled < COUNT / 2
