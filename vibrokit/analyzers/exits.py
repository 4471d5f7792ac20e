"""Exits: what counts as leaving."""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod

from vibrokit.kernels.ensemble import Stop
from vibrokit.results.structure import Structure


@dataclasses.dataclass(frozen=True)
class Exit(ABC):
    """What counts as leaving an attractor. Abstract."""

    @abstractmethod
    def stop(self, structure: Structure, home: int) -> Stop:
        """Return the kernel's test for a trajectory that started at the attractor `home`."""


@dataclasses.dataclass(frozen=True)
class LeaveBasin(Exit):
    """Leaving the basin of attraction, seen at the section, for the basin of another attractor."""

    def stop(self, structure: Structure, home: int) -> Stop:
        """Return the test by the basin grid."""
        basins = structure.basins
        return Stop(region=basins.region.bounds, labels=basins.labels, home=home)
