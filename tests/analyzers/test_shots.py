"""Confirmation of exits, with a shooter that knows beforehand which paths are exits."""

from types import SimpleNamespace

import numpy as np
import pytest

from vibrokit.analyzers.shooting.outcomes import Outcomes, Shooter
from vibrokit.kernels.stopping import COMPLETED, LEFT_BASIN


class Knowing(Shooter):
    """Settles paths by what is known of them, and counts them."""

    exits = np.empty(0, dtype=bool)
    settled = 0

    def _settle(self, outcomes, which):
        object.__setattr__(self, "settled", self.settled + len(which))
        outcomes.confirmed[which] = self.exits[which]
        outcomes.status[which[~self.exits[which]]] = COMPLETED


def confirmed(actions, exits, factor):
    """Confirm paths, of which some are exits."""
    count = len(exits)
    states = np.zeros((count, 5))
    states[:, -1] = actions
    whole = np.zeros(count, dtype=np.int64)
    unknown = np.zeros(count, dtype=bool)
    outcomes = Outcomes(states, whole, states, whole + LEFT_BASIN, whole, whole, unknown, whole.copy())
    problem = SimpleNamespace(exit=SimpleNamespace(by_position=False), structure=SimpleNamespace(attractors=[None]))
    shooter = Knowing(problem, None, 0)
    object.__setattr__(shooter, "exits", exits)
    shooter.confirm(outcomes, factor)
    return shooter, outcomes


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9])
@pytest.mark.parametrize("factor", [1.0, 1.5])
def test_exits_up_to_a_factor_are_confirmed_and_few_others_settle(share, factor):
    generator = np.random.default_rng(0)
    actions, exits = generator.uniform(1.0, 10.0, 5000), generator.random(5000) > share
    shooter, outcomes = confirmed(actions, exits, factor)
    least = actions[exits].min()
    wanted = exits & ((actions < factor * least) | (actions == least))
    assert outcomes.confirmed[wanted].all()
    assert exits[outcomes.confirmed].all()
    assert shooter.settled < len(exits) / 2


def test_an_exit_is_found_behind_many_cheaper_paths_that_are_none():
    actions = np.linspace(1.0, 10.0, 200_000)
    exits = actions == 10.0
    _, outcomes = confirmed(actions, exits, 1.0)
    np.testing.assert_array_equal(outcomes.confirmed, exits)
