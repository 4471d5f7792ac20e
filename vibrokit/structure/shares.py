"""Shares of a region that lead to steady states which are known already."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from vibrokit.kernels.choice import ensemble_stepper
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.results.basins import LEFT, NOT_FOLLOWED, UNSETTLED
from vibrokit.results.region import Region
from vibrokit.structure.search import persistent
from vibrokit.structure.settle import Settler, settle_grid
from vibrokit.symbolic.flow_kind import Flow

_SETTLING = 1e-3
_REFINEMENTS = 4  # of the carrier, until every attractor is one for it too
_FATES = {UNSETTLED: "did not settle in the time given", LEFT: "left the region", NOT_FOLLOWED: "were not followed"}


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
    carrier = stepper or ensemble_stepper(osc, Flow.STATE)
    for _ in range(_REFINEMENTS if stepper is None else 0):
        if persistent(osc, own, carrier, tolerance):
            break
        carrier = carrier.refined()
    labels = settle_grid(Settler(osc, own, region, tolerance, budget, carrier), cells).labels
    shares = [float(np.mean(labels == attractor.label)) for attractor in own]
    fates = [(float(np.mean(labels == label)), fate) for label, fate in _FATES.items()]
    words = tuple(f"{100 * share:.2g}% of the cells {fate}." for share, fate in fates if share)
    if (labels == NOT_FOLLOWED).any():
        return Shared(own, False, words)
    measured = tuple(
        dataclasses.replace(
            attractor, basin_fraction=share, basin_fraction_error=math.sqrt(share * (1 - share) / labels.size)
        )
        for attractor, share in zip(own, shares, strict=True)
    )
    return Shared(measured, True, words)
