"""Work and precision of basin grids on one scene: the time per cell, and how many cells are wrong."""

from __future__ import annotations

import dataclasses
import itertools
import time
import warnings

import numpy as np
from numpy.typing import NDArray

from vibrokit.kernels.choice import CoarseStepsWarning
from vibrokit.kernels.named import named_stepper
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.progress import Progress, advance, stage, working
from vibrokit.results.structure import Structure
from vibrokit.structure.basins.classifier import BasinClassifier
from vibrokit.structure.basins.grid import classify_grid
from vibrokit.structure.find import find_structure
from vibrokit.text_table import text_table

MARGINS: tuple[int | None, ...] = (1, 2, 3, None)


@dataclasses.dataclass(frozen=True)
class BasinRow:
    """One setting of a basin grid."""

    stepper: str
    margin: int | None  # cells that must agree around one that decides for what enters it; None: each is followed
    wrong: float  # share of the cells whose label differs from the reference's
    shift: float  # largest change of a basin's share of the region
    seconds: float  # per cell, on all threads
    default: bool  # whether this is what `find_structure` does


@dataclasses.dataclass(frozen=True)
class BasinTrade:
    """Work and precision of basin grids, coarse to fine; the reference has twice refined steps, every cell followed."""

    rows: tuple[BasinRow, ...]
    cells: tuple[int, int]
    reference: str

    def __str__(self) -> str:
        headings = ("stepper", "margin", "wrong cells", "basin shift", "per cell (µs)", "")
        lines = [
            f"Basins on {self.cells[0]} × {self.cells[1]} cells, against {self.reference} with every cell followed.",
            "",
            *text_table([headings, *map(_line, self.rows)]),
        ]
        return "\n".join(lines)


def _line(row: BasinRow) -> tuple[str, ...]:
    margin = "none" if row.margin is None else str(row.margin)
    numbers = f"{100 * row.wrong:.3f} %", f"{row.shift:.1e}", f"{1e6 * row.seconds:.3g}"
    return (row.stepper, margin, *numbers, "← default" if row.default else "")


def measure_basins(
    osc: Oscillator,
    *,
    cells: tuple[int, int] = (80, 80),
    margins: tuple[int | None, ...] = MARGINS,
    progress: Progress = None,
) -> BasinTrade:
    """Measure time and error of the basin grid over steps and margins, for the attractors that the scene has.

    `margins` are given to `find_structure`. StructureError is raised if the scene has no attractors.
    """
    with working(progress), warnings.catch_warnings():
        warnings.simplefilter("ignore", CoarseStepsWarning)  # too few steps are measured here on purpose
        structure = find_structure(osc, cells=(2, 2), saddles=False)
        chosen = named_stepper(structure.stepper)
        ladder = [chosen.coarsened().coarsened(), chosen.coarsened(), chosen, chosen.refined()]
        finest = chosen.refined().refined()
        rows = []
        with stage("basin grids", unit="settings", total=len(ladder) * len(margins) + 1):
            reference = _labelled(osc, structure, finest, cells, None)[0]
            advance()
            for stepper, margin in itertools.product(ladder, margins):
                labels, seconds = _labelled(osc, structure, stepper, cells, margin)
                default = stepper == chosen and margin == 2
                wrong = float(np.mean(labels != reference))
                rows.append(BasinRow(repr(stepper), margin, wrong, _shift(labels, reference), seconds, default))
                advance()
    return BasinTrade(tuple(rows), cells, repr(finest))


def _labelled(
    osc: Oscillator, structure: Structure, stepper: Stepper, cells: tuple[int, int], margin: int | None
) -> tuple[NDArray[np.int16], float]:
    """Labels of a grid and the time per cell (s); a small grid is run before, so that compilation is not timed."""
    classifier = BasinClassifier.of(osc, structure, stepper)
    classify_grid(classifier, (2, 2), margin=margin)
    began = time.perf_counter()
    labels = classify_grid(classifier, cells, margin=margin).labels
    return labels, (time.perf_counter() - began) / labels.size


def _shift(labels: NDArray[np.int16], reference: NDArray[np.int16]) -> float:
    shares = [abs(float(np.mean(labels == label) - np.mean(reference == label))) for label in np.unique(reference)]
    return max(shares)
