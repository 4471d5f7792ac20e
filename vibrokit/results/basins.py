"""Basins on a grid: where each cell of the region leads."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from vibrokit.results.region import Region

UNSETTLED = -1
"""Label of cells whose motion is in the region and had reached no attractor within the budget."""
LEFT = -2
"""Label of cells whose motion was outside the region at the end of the budget, or diverged."""
NOT_FOLLOWED = -3
"""Label of cells that were not followed, because the work was stopped."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Basins:
    """Labels of the cells of a region.

    Attributes
    ----------
    region : Region
    labels : int16 array (nx, nv)
        Label of the attractor that each cell's centre leads to; UNSETTLED, LEFT or NOT_FOLLOWED if it leads to none.
    """

    region: Region
    labels: NDArray[np.int16]

    def fraction(self, label: int) -> float:
        """Share of the cells with a label."""
        return float(np.mean(self.labels == label))

    def __repr__(self) -> str:
        return f"Basins: {' × '.join(map(str, self.labels.shape))} cells on {self.region}"
