"""Structure: what the noise-free system does."""

from __future__ import annotations

import dataclasses
from typing import Any

from vibrokit.errors import StructureError
from vibrokit.structure.attractor import Attractor
from vibrokit.structure.basins import Basins


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Structure:
    """Attractors and basins of a scene.

    Attributes
    ----------
    attractors : tuple of Attractor
        Those that run clear of the stops first, then by stop hits.
    basins : Basins
    settling : float
        Distance at which an attractor counts as reached.
    budget : int
        Most periods that a trajectory was given to settle.
    status : str
        What was found and what was not, as sentences.
    saddles, manifolds : tuple
        Not looked for yet; empty.
    """

    attractors: tuple[Attractor, ...]
    basins: Basins
    settling: float
    budget: int
    status: str
    saddles: tuple[Any, ...] = ()
    manifolds: tuple[Any, ...] = ()

    def __repr__(self) -> str:
        return f"<Structure: {self.status}>"

    def attractor(self, label: int) -> Attractor:
        """Return the attractor of a label.

        Raises
        ------
        StructureError
            There is none of that label.
        """
        for attractor in self.attractors:
            if attractor.label == label:
                return attractor
        known = ", ".join(str(attractor.label) for attractor in self.attractors)
        raise StructureError(f"there is no attractor of label {label!r}; there are {known}.")

    def plot(self, ax: Any = None) -> Any:
        """Draw the basins and attractors on the section; see `vibrokit.plots.basins.basin_map`."""
        from vibrokit.plots.basins import basin_map

        points = [attractor.points for attractor in self.attractors]
        return basin_map(self.basins.labels, self.basins.region.bounds, points, ax=ax)
