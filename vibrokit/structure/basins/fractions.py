"""Basin fractions: shares of a region's cells that lead to each attractor."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

from vibrokit.kernels.choice import ensemble_stepper
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.results.basins import LEFT, NOT_FOLLOWED, UNSETTLED, Basins
from vibrokit.results.finding import Code, Finding
from vibrokit.results.region import Region
from vibrokit.structure.basins.classifier import BasinClassifier
from vibrokit.structure.basins.grid import classify_grid
from vibrokit.structure.search import persistent_stepper
from vibrokit.symbolic.flow_kind import Flow

_SETTLING = 1e-3  # of the region's size, the default of `find_structure`
_WITHOUT_ATTRACTOR = {
    UNSETTLED: Code.CELLS_UNSETTLED, LEFT: Code.CELLS_LEFT_REGION, NOT_FOLLOWED: Code.CELLS_NOT_FOLLOWED,
}  # fmt: skip
CELL_CODES = tuple(_WITHOUT_ATTRACTOR.values())
"""Codes of the findings about cells that lead to no attractor."""


def with_fractions(attractors: Sequence[Attractor], basins: Basins) -> tuple[Attractor, ...]:
    """Return attractors with their shares of the cells, and the standard errors of these as shares of the region."""
    shares = [basins.fraction(attractor.label) for attractor in attractors]
    return tuple(
        dataclasses.replace(
            attractor, basin_fraction=share, basin_fraction_error=math.sqrt(share * (1 - share) / basins.labels.size)
        )
        for attractor, share in zip(attractors, shares, strict=True)
    )


def cell_findings(basins: Basins) -> tuple[Finding, ...]:
    """Return findings about the cells that lead to no attractor."""
    shares = {code: basins.fraction(label) for label, code in _WITHOUT_ATTRACTOR.items()}
    return tuple(Finding.of(code, fraction=share) for code, share in shares.items() if share)


def basin_fractions(
    osc: Oscillator,
    attractors: Sequence[Attractor],
    region: Region,
    cells: tuple[int, int],
    budget: int,
    stepper: Stepper | None,
) -> tuple[tuple[Attractor, ...], tuple[Finding, ...]]:
    """Find the share of a region's cells that lead to each attractor, and what became of the other cells."""
    tolerance = _SETTLING * region.size
    chosen = stepper or persistent_stepper(osc, attractors, ensemble_stepper(osc, Flow.STATE), tolerance)
    basins = classify_grid(BasinClassifier(osc, attractors, region, tolerance, budget, chosen), cells)
    return with_fractions(attractors, basins), cell_findings(basins)
