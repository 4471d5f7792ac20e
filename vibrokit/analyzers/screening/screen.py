"""Screen: what the graph knows of the ways out of one attractor."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.candidate import Candidate
from vibrokit.analyzers.exits import Exit
from vibrokit.analyzers.screening.grids import Grids
from vibrokit.analyzers.screening.levels import levels
from vibrokit.analyzers.screening.potential import Potential
from vibrokit.errors import StructureError
from vibrokit.kernels.ensemble import Progress
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.results.structure import Structure

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class Screen:
    """Least actions out of an attractor, on the grid.

    Attributes
    ----------
    source : int
        Label of the attractor.
    barriers : dict of int to (float, float)
        V at each saddle of its boundary, by the saddle's place in the structure, and how far it may be wrong.
    targets : dict of int to (float, float)
        The same for each attractor that can be reached; −1 for a touch.
    candidates : tuple of Candidate
        Paths to each way out, as `Levels.paths` has them; their last state is beyond the exit.
    saddles : dict of int to int
        By target: the saddle that the cheapest way leads over; −1 for none.
    potential : Potential
    stepper : Stepper
    words : tuple of str
        What was not found.
    """

    source: int
    barriers: dict[int, tuple[float, float]]
    targets: dict[int, tuple[float, float]]
    candidates: tuple[Candidate, ...]
    saddles: dict[int, int]
    potential: Potential
    stepper: Stepper
    words: tuple[str, ...]


def screen(
    osc: Oscillator,
    structure: Structure,
    attractor: Attractor,
    exit: Exit,  # noqa: A002 - the word of all analyzers
    stepper: Stepper,
    cells: tuple[int, int],
    fractions: Sequence[int],
    progress: Progress | None = None,
) -> Screen:
    """Search all ways out of an attractor.

    Raises
    ------
    StructureError
        None was reached, or the attractor is not hyperbolic.
    """
    bounds = structure.basins.region.bounds
    if np.any((attractor.points[:, :2] < bounds[:, 0]) | (attractor.points[:, :2] > bounds[:, 1])):
        raise StructureError(
            f"attractor {attractor.label} lies outside the region of the structure, and the graph covers no more than "
            "that; find the structure on a wider region."
        )
    ways = exit.ways(osc, structure, attractor, stepper)

    def inside(grids: Grids, phase: int) -> NDArray[np.bool_]:
        return exit.within(osc, structure, attractor, stepper, grids, phase)

    scene = exit.scene(osc)
    found = levels(scene, structure, attractor, ways, inside, stepper, cells, fractions, progress)
    barriers: dict[int, tuple[float, float]] = {}
    targets: dict[int, tuple[float, float]] = {}
    saddles: dict[int, int] = {}
    candidates, words = [], []
    for way in sorted(ways, key=lambda way: way.cost(found.fine)):
        paths = found.paths(way)
        cost = found.cost(way, paths[0].action if paths else float("nan"))
        if not np.isfinite(cost).all():
            continue
        if way.saddle >= 0:
            barriers[way.saddle] = cost
        if way.target not in targets:
            targets[way.target], saddles[way.target] = cost, way.saddle
        candidates += paths
        if not paths:
            words.append(f"The path of the graph to attractor {way.target} could not be followed back.")
    if not targets:
        raise StructureError(f"the grid reaches no way out of attractor {attractor.label}; widen the region.")
    return Screen(attractor.label, barriers, targets, tuple(candidates), saddles, found.fine, stepper, tuple(words))
