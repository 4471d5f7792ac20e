"""Shares of a region that lead to steady states which are known already."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

from vibrokit.kernels.choice import ensemble_stepper
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.results.basins import NOT_FOLLOWED, Basins
from vibrokit.results.region import Region
from vibrokit.structure.search import lasting_carrier
from vibrokit.structure.settle import Settler, settle_grid
from vibrokit.structure.status import fates_of
from vibrokit.symbolic.flow_kind import Flow

_SETTLING = 1e-3


@dataclasses.dataclass(frozen=True, eq=False)
class Shared:
    """Attractors with their basin fractions.

    Attributes
    ----------
    attractors : tuple of Attractor
    complete : bool
        Whether all cells were followed.
    words : tuple of str
        What became of cells that lead to none of them, as sentences.
    """

    attractors: tuple[Attractor, ...]
    complete: bool
    words: tuple[str, ...]


def share_out(
    osc: Oscillator,
    attractors: Sequence[Attractor],
    region: Region,
    cells: tuple[int, int],
    budget: int,
    stepper: Stepper | None,
) -> Shared:
    """Find the share of a region's cells that lead to each of some attractors, and label these by their place."""
    own = tuple(dataclasses.replace(attractor, label=label) for label, attractor in enumerate(attractors))
    tolerance = _SETTLING * region.size
    carrier = stepper or lasting_carrier(osc, own, ensemble_stepper(osc, Flow.STATE), tolerance)
    basins = settle_grid(Settler(osc, own, region, tolerance, budget, carrier), cells)
    words = tuple(fates_of(basins))
    if (basins.labels == NOT_FOLLOWED).any():
        return Shared(own, False, words)
    return Shared(tuple(with_basin(attractor, basins) for attractor in own), True, words)


def with_basin(attractor: Attractor, basins: Basins) -> Attractor:
    """Return an attractor with its share of the cells, and the standard error of that as a share of the region."""
    share = basins.fraction(attractor.label)
    error = math.sqrt(share * (1 - share) / basins.labels.size)
    return dataclasses.replace(attractor, basin_fraction=share, basin_fraction_error=error)
