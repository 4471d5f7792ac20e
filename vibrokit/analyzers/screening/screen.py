"""Screen: what the graph knows of the ways out of one attractor."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.analyzer import part_of
from vibrokit.analyzers.candidate import Candidate
from vibrokit.analyzers.exits import Exit
from vibrokit.analyzers.screening.grids import Grids
from vibrokit.analyzers.screening.levels import Levels, levels
from vibrokit.analyzers.screening.potential import Potential
from vibrokit.analyzers.screening.ways_out import Way
from vibrokit.errors import StructureError
from vibrokit.kernels.ensemble import Progress
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.results.structure import Structure

_FAR_LESS = 0.25  # of the dearest way out
_TURNS = 4

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

    def solved(some: Sequence[Way], part: Progress | None) -> Levels:
        return levels(scene, structure, attractor, some, inside, stepper, cells, fractions, part)

    known = _on_grids_of_their_own(ways, solved, progress)
    barriers: dict[int, tuple[float, float]] = {}
    targets: dict[int, tuple[float, float]] = {}
    saddles: dict[int, int] = {}
    candidates, words = [], []
    for way in sorted(ways, key=lambda way: way.cost(known[way].fine)):
        paths = known[way].paths(way)
        cost = known[way].cost(way)
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
    widest = known[max(ways, key=lambda way: known[way].fine.unreached)].fine
    return Screen(attractor.label, barriers, targets, tuple(candidates), saddles, widest, stepper, tuple(words))


def _on_grids_of_their_own(
    ways: Sequence[Way], solved: Callable[[Sequence[Way], Progress | None], Levels], progress: Progress | None
) -> dict[Way, Levels]:
    """By way out, the potential on a grid that reaches little farther than that way needs.

    A grid that holds the dearest way out has few cells for one that costs far less. So those that do are looked at
    again without the others.
    """
    known = dict.fromkeys(ways, solved(ways, part_of(progress, 0, _TURNS)))
    for turn in range(1, _TURNS):
        costs = {way: way.cost(known[way].fine) for way in ways}
        dearest = max((cost for cost in costs.values() if np.isfinite(cost)), default=0.0)
        ways = [way for way in ways if 0 < costs[way] < _FAR_LESS * dearest]
        if not ways:
            break
        try:
            closer = solved(ways, part_of(progress, turn, _TURNS))
        except StructureError:  # too near to the attractor for any grid
            break
        ways = [way for way in ways if closer.cost(way)[1] < known[way].cost(way)[1]]
        known.update(dict.fromkeys(ways, closer))
    if progress is not None:
        progress(1, 1)
    return known
