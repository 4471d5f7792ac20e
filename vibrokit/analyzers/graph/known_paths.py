"""KnownPaths: what is known of the exits of an attractor before the graph is searched."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence, Set

import numpy as np

from vibrokit.analyzers.graph.targets import ExitTarget
from vibrokit.results.energy import ActivationEnergy


@dataclasses.dataclass(frozen=True, eq=False)
class KnownPaths:
    """Paths whose actions are known, and which exits need no graph."""

    branches: Sequence[ActivationEnergy] = ()  # with their paths
    settled: Set[int] = frozenset()  # labels of the attractors whose energies need no more

    def to(self, targets: Sequence[ExitTarget]) -> list[ActivationEnergy]:
        """Return the cheapest known path to each attractor that is reached from some targets."""
        labels = {label for target in targets for label in target.labels}
        cheapest: dict[int, ActivationEnergy] = {}
        for branch in self.branches:
            label = branch.target
            usable = label in labels and branch.path is not None and len(branch.path.section)
            if usable and (label not in cheapest or branch.value < cheapest[label].value):
                cheapest[label] = branch
        return list(cheapest.values())

    def cost(self, target: ExitTarget) -> float:
        """Return the action of the costliest path to the attractors that are reached from a target.

        Infinite if a path to one of them is not known.
        """
        known = {branch.target: branch.value for branch in self.to((target,))}
        return max((known.get(label, np.inf) for label in target.labels), default=np.inf)
