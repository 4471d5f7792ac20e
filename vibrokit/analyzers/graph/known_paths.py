"""KnownPaths: what is known of the exits of an attractor before the graph is searched."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence, Set
from functools import cached_property

import numpy as np

from vibrokit.analyzers.graph.targets import ExitTarget
from vibrokit.analyzers.graph.tolerances import TOLERANCES
from vibrokit.results.energy import ActivationEnergy


@dataclasses.dataclass(frozen=True, eq=False)
class KnownPaths:
    """Paths whose actions are known, and which exits need no graph."""

    branches: Sequence[ActivationEnergy] = ()  # with their paths
    settled: Set[int] = frozenset()  # labels of the attractors whose energies need no more

    @property
    def unsettled_paths(self) -> list[ActivationEnergy]:
        """The cheapest known path to each attractor that is not settled."""
        return [branch for label, branch in self._cheapest.items() if label not in self.settled]

    def to(self, targets: Sequence[ExitTarget]) -> list[ActivationEnergy]:
        """Return the cheapest known path to each attractor that is reached from some targets, unless it is settled."""
        labels = {label for target in targets for label in target.labels}
        return [branch for branch in self.unsettled_paths if branch.target in labels]

    def with_settled(self, labels: Set[int]) -> KnownPaths:
        """Return the same paths, with more attractors settled."""
        return dataclasses.replace(self, settled=self.settled | labels)

    def leads_to_all(self, targets: Sequence[ExitTarget]) -> bool:
        """Return whether a path is known to each attractor that is reached from some targets."""
        return all(np.isfinite(self.cost(target)) for target in targets)

    def needs(self, target: ExitTarget) -> bool:
        """Return whether an exit that needs the graph may lead there.

        It does not if a known path to the same attractor costs far less by another saddle, whose grids reach less far.
        """
        for label in set(target.labels) - self.settled:
            costs = [(branch.value, branch.saddle) for branch in self.branches if branch.target == label]
            own = min((value for value, saddle in costs if saddle == target.saddle), default=np.inf)
            least = min((value for value, _ in costs), default=np.inf)
            if not (np.isfinite(own) and least < TOLERANCES.far_less * own):
                return True
        return False

    def cost(self, target: ExitTarget) -> float:
        """Return the action of the costliest path to the attractors that are reached from a target.

        Infinite if a path to one of them is not known.
        """
        known = self._cheapest
        return max((known[label].value if label in known else np.inf for label in target.labels), default=np.inf)

    @cached_property
    def _cheapest(self) -> dict[int, ActivationEnergy]:
        """By label: the cheapest path whose states are known."""
        found: dict[int, ActivationEnergy] = {}
        for branch in self.branches:
            label, usable = branch.target, branch.path is not None and len(branch.path.section)
            if usable and (label not in found or branch.value < found[label].value):
                found[label] = branch
        return found
