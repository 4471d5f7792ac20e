"""Basins on a grid: where each cell of the region leads."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from vibrokit.results.region import Region

UNSETTLED = -1
"""Label of cells that reached no attractor in the time given, and are in the region still."""
LEFT = -2
"""Label of cells whose motion left the region, or every bound, and was not back when the time was up."""
NOT_FOLLOWED = -3
"""Label of cells that were not looked at, because the work was stopped."""


@dataclasses.dataclass(frozen=True, eq=False)
class Basins:
    """Labels of the cells of a region.

    Attributes
    ----------
    region : Region
    labels : int16 array (nx, nv)
        Label of the attractor that each cell's centre leads to; UNSETTLED, LEFT or NOT_FOLLOWED where it leads to none.
    """

    region: Region
    labels: NDArray[np.int16]

    def fraction(self, label: int) -> float:
        """Share of the cells with a label."""
        return float(np.mean(self.labels == label))
