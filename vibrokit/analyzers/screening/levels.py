"""Levels: one potential on finer and coarser grids, and with longer steps: how far it can be trusted."""

from __future__ import annotations

import concurrent.futures
import dataclasses
import os
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.screening.grids import Grids, covering
from vibrokit.analyzers.screening.potential import Iteration, Potential
from vibrokit.analyzers.screening.ways_out import Way
from vibrokit.errors import StructureError
from vibrokit.kernels.ensemble import Progress
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.results.structure import Structure

_ROOM = 1.5  # V up to which paths are followed, over the dearest way out
_NEARLY = 0.8  # of that V: a way out that costs more may owe it to the limit
_RAISED = 3.0
_RAISES = 6
_STAGES = 4
_ZOOMS = 4
_WORTHWHILE = 0.8  # of the area before: more does not pay another round
_BY_STEP = 0.5  # share of what doubling the step changes that counts as error: the price is of second order at least

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class Levels:
    """A potential, and two poorer ones.

    Attributes
    ----------
    whole : Potential
        On half as many nodes along each side, of all that the region covers.
    fine : Potential
        On the nodes asked for, of what can be reached for little more than leaving costs.
    coarse : Potential
        The same on half as many nodes along each side.
    long : Potential
        The same with steps twice as long as well.
    from_set : bool
        Whether the attractor is no orbit, but a set that is some cells thick on the grid.
    """

    whole: Potential
    fine: Potential
    coarse: Potential
    long: Potential
    from_set: bool

    def cost(self, way: Way) -> tuple[float, float]:
        """Return what a way out costs, and how far this may be wrong.

        The error is what halving the grid changed, and half of what doubling the step did; from a set also how V rises
        near by.
        """
        fine, coarse, long = (way.cost(potential) for potential in (self.fine, self.coarse, self.long))
        if not np.isfinite([fine, coarse, long]).all():
            whole = way.cost(self.whole)
            return whole, whole
        blur = way.blur(self.fine) if self.from_set else 0.0
        return fine, abs(fine - coarse) + _BY_STEP * abs(coarse - long) + blur


def levels(
    osc: Oscillator,
    structure: Structure,
    attractor: Attractor,
    ways: Sequence[Way],
    inside: Callable[[Grids, int], NDArray[np.bool_]],
    stepper: Stepper,
    cells: tuple[int, int],
    fraction: int,
    progress: Progress | None = None,
) -> Levels:
    """Find the potential of an attractor; see `Levels`.

    Raises
    ------
    StructureError
        No way out was reached, or the attractor is not hyperbolic.
    """
    half = (max(16, cells[0] // 2), max(16, cells[1] // 2))
    done = iter(range(1, _STAGES + 1))

    def tell() -> None:
        if progress is not None:
            progress(next(done), _STAGES)

    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as executor:

        def solved(grids: Grids, limit: float) -> tuple[Potential, float]:
            for _ in range(_RAISES):
                potential = Iteration(osc, stepper, attractor, grids, limit, executor).run()
                costs = [way.cost(potential) for way in ways]
                dearest = max([cost for cost in costs if np.isfinite(cost)], default=np.inf)
                if dearest < _NEARLY * limit:
                    return potential, dearest
                limit *= _RAISED
            raise StructureError(
                f"no way out of attractor {attractor.label} was reached on the grid: the region, or the cells asked "
                "for, leave no room for it; widen the region or take more cells."
            )

        limit = 2 * max(way.bound for way in ways)
        grids = covering(osc, stepper, structure.basins.region, fraction, half)
        whole, dearest = solved(grids, limit)
        tell()
        coarse = whole
        for _ in range(_ZOOMS):
            near = [values < _ROOM * dearest for values in coarse.values]
            wanted = [mask & inside(grids, phase) for phase, mask in enumerate(near)]
            zoomed = grids.zoomed(wanted)
            gain = zoomed.area / grids.area
            if coarse is not whole and gain > _WORTHWHILE:
                break
            grids = zoomed
            coarse, dearest = solved(grids, _ROOM * dearest)
        tell()
        doubled = dataclasses.replace(grids, boxes=grids.boxes[::2], step=2 * grids.step)
        long, _ = solved(doubled, _ROOM * dearest)
        tell()
        fine, _ = solved(grids.of(cells), _ROOM * dearest)
        tell()
    return Levels(whole, fine, coarse, long, attractor.kind not in ("periodic", "equilibrium"))
