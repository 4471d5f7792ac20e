"""KnownPaths: what is known of the exits of an attractor before the graph is searched."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence, Set

import numpy as np

from vibrokit.analyzers.graph.coverage import FAR_LESS
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

    def leads_to_all(self, targets: Sequence[ExitTarget]) -> bool:
        """Return whether a path is known to each attractor that is reached from some targets."""
        return bool(np.isfinite([self.cost(target) for target in targets]).all())

    def needs(self, target: ExitTarget) -> bool:
        """Return whether an exit that needs the graph may lead there.

        It does not if a known path to the same attractor costs far less by another saddle, whose grids reach less far.
        """
        for label in set(target.labels) - self.settled:
            costs = [(branch.value, branch.saddle) for branch in self.branches if branch.target == label]
            own = min((value for value, saddle in costs if saddle == target.saddle), default=np.inf)
            least = min((value for value, _ in costs), default=np.inf)
            if not (np.isfinite(own) and least < FAR_LESS * own):
                return True
        return False

    def cost(self, target: ExitTarget) -> float:
        """Return the action of the costliest path to the attractors that are reached from a target.

        Infinite if a path to one of them is not known.
        """
        known = {branch.target: branch.value for branch in self.to((target,))}
        return max((known.get(label, np.inf) for label in target.labels), default=np.inf)
