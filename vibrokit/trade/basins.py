"""Work and precision of basin grids on one scene: what a cell costs, and how many are wrong."""

from __future__ import annotations

import dataclasses
import time
import warnings

import numpy as np
from numpy.typing import NDArray

from vibrokit.kernels.choice import CoarseStepsWarning
from vibrokit.kernels.ensemble import Progress
from vibrokit.kernels.named import named_stepper
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.results.structure import Structure
from vibrokit.structure.find import find_structure
from vibrokit.structure.settle import Settler, settle_grid

MARGINS: tuple[int | None, ...] = (1, 2, 3, None)
_DEFAULT_MARGIN = 2


@dataclasses.dataclass(frozen=True)
class BasinRow:
    """One setting of a basin grid.

    Attributes
    ----------
    stepper : str
        What carried the cells.
    margin : int or None
        Cells on every side that must agree before one answers for what enters it; None: every cell is followed.
    wrong : float
        Share of the cells of which the label differs from the reference's.
    shift : float
        Largest change of a basin's share of the region.
    seconds : float
        Time per cell, all threads at work.
    default : bool
        Whether this is what `find_structure` does.
    """

    stepper: str
    margin: int | None
    wrong: float
    shift: float
    seconds: float
    default: bool


@dataclasses.dataclass(frozen=True)
class BasinTrade:
    """Work and precision of basin grids.

    Attributes
    ----------
    rows : tuple of BasinRow
        Coarse to fine.
    cells : (int, int)
    reference : str
        What the labels are compared with: twice refined steps, every cell followed.
    """

    rows: tuple[BasinRow, ...]
    cells: tuple[int, int]
    reference: str

    def __str__(self) -> str:
        lines = [
            f"Basins on {self.cells[0]} × {self.cells[1]} cells, against {self.reference} with every cell followed.",
            "",
            "carrier                       margin  wrong cells  basin shares  per cell (µs)",
        ]
        for row in self.rows:
            margin = "none" if row.margin is None else str(row.margin)
            mark = "  ← default" if row.default else ""
            line = f"{row.stepper:<28}  {margin:<6}  {100 * row.wrong:<9.3f} %  {row.shift:<12.1e}  "
            lines.append(f"{line}{1e6 * row.seconds:<11.3g}{mark}".rstrip())
        return "\n".join(lines)


def measure_basins(
    osc: Oscillator,
    *,
    cells: tuple[int, int] = (80, 80),
    margins: tuple[int | None, ...] = MARGINS,
    progress: Progress | None = None,
) -> BasinTrade:
    """Measure time and error of the basin grid over steps and margins, for the attractors that the scene has.

    Parameters
    ----------
    osc : Oscillator
    cells : (int, int)
    margins : tuple of int or None
        Given to `find_structure` as `margin`.
    progress : callable, optional
        Called with (settings done, settings in all).

    Returns
    -------
    BasinTrade

    Raises
    ------
    StructureError
        The scene has no attractors.
    """
    structure = find_structure(osc, cells=(2, 2), saddles=False)
    carrier = named_stepper(structure.stepper)
    ladder = [carrier.coarsened().coarsened(), carrier.coarsened(), carrier, carrier.refined()]
    settings = [(stepper, margin) for stepper in ladder for margin in margins]
    report = progress or (lambda done, total: None)
    finest = carrier.refined().refined()
    report(0, len(settings) + 1)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CoarseStepsWarning)  # too few steps are what is measured here
        reference = _labelled(osc, structure, finest, cells, None)[0]
        rows = []
        for done, (stepper, margin) in enumerate(settings, start=1):
            report(done, len(settings) + 1)
            labels, seconds = _labelled(osc, structure, stepper, cells, margin)
            default = stepper == carrier and margin == _DEFAULT_MARGIN
            wrong = float(np.mean(labels != reference))
            rows.append(BasinRow(repr(stepper), margin, wrong, _shift(labels, reference), seconds, default))
    report(len(settings) + 1, len(settings) + 1)
    return BasinTrade(tuple(rows), cells, repr(finest))


def _labelled(
    osc: Oscillator, structure: Structure, stepper: Stepper, cells: tuple[int, int], margin: int | None
) -> tuple[NDArray[np.int16], float]:
    """Labels of a grid, and the seconds that each cell took; once before the clock starts, for what is compiled."""
    settler = Settler(osc, structure.attractors, structure.basins.region, structure.settling, structure.budget, stepper)
    settle_grid(settler, (2, 2), margin=margin)
    began = time.perf_counter()
    labels = settle_grid(settler, cells, margin=margin).labels
    return labels, (time.perf_counter() - began) / labels.size


def _shift(labels: NDArray[np.int16], reference: NDArray[np.int16]) -> float:
    shares = [abs(float(np.mean(labels == label) - np.mean(reference == label))) for label in np.unique(reference)]
    return max(shares)
