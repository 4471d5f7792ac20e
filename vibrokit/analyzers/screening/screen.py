"""Screen: what the graph knows of the ways out of one attractor."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.candidate import Candidate
from vibrokit.analyzers.exits import Exit
from vibrokit.analyzers.polishing.carrier import Carrier
from vibrokit.analyzers.polishing.chain import priced_chain
from vibrokit.analyzers.polishing.relaxing import price
from vibrokit.analyzers.screening.grids import Grids
from vibrokit.analyzers.screening.levels import Levels, levels
from vibrokit.analyzers.screening.paths import Followed, follow_back
from vibrokit.analyzers.screening.potential import Potential
from vibrokit.analyzers.screening.ways_out import Way
from vibrokit.errors import StructureError
from vibrokit.kernels.choice import single_stepper
from vibrokit.kernels.ensemble import Progress
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.results.structure import Structure
from vibrokit.symbolic.flow_kind import Flow

_FINDER = "graph"

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
        The cheapest path of each way out, the cheapest first; their last state is beyond the exit.
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
    ways = exit.ways(osc, structure, attractor, stepper)

    def inside(grids: Grids, phase: int) -> NDArray[np.bool_]:
        return exit.within(osc, structure, attractor, stepper, grids, phase)

    found = levels(osc, structure, attractor, ways, inside, stepper, cells, fractions, progress)
    barriers: dict[int, tuple[float, float]] = {}
    targets: dict[int, tuple[float, float]] = {}
    saddles: dict[int, int] = {}
    candidates, words = [], []
    for way in sorted(ways, key=lambda way: way.cost(found.fine)):
        candidate = _candidate(osc, stepper, found, way, attractor.label)
        cost = found.cost(way, 0.0 if candidate is None else linearisation(osc, found, candidate))
        if not np.isfinite(cost).all():
            continue
        if way.saddle >= 0:
            barriers[way.saddle] = cost
        if way.target not in targets:
            targets[way.target], saddles[way.target] = cost, way.saddle
        if candidate is None:
            words.append(f"The path of the graph to attractor {way.target} could not be followed back.")
        else:
            candidates.append(candidate)
    if not targets:
        raise StructureError(f"the grid reaches no way out of attractor {attractor.label}; widen the region.")
    return Screen(attractor.label, barriers, targets, tuple(candidates), saddles, found.fine, stepper, tuple(words))


def _candidate(osc: Oscillator, stepper: Stepper, found: Levels, way: Way, source: int) -> Candidate | None:
    potential = found.fine if np.isfinite(way.cost(found.fine)) else found.whole
    tip = way.tip(potential)
    path: Followed | None = follow_back(osc, stepper, potential, tip.state, tip.phase)
    if path is None:
        return None
    states = np.concatenate([path.states, tip.beyond])
    action = way.cost(potential) if len(tip.beyond) else path.action
    times: Array = potential.grids.step * np.arange(len(states), dtype=float)
    return Candidate(source, way.target, times, states, action, _FINDER)


def linearisation(osc: Oscillator, found: Levels, candidate: Candidate) -> float:
    """Return by how much the price of a path changes when each of its steps is priced by Hamilton's equations.

    0 where that finds no price: then the change by longer steps is all that is known.
    """
    pieces = round(osc.section_interval / found.fine.grids.step)
    carrier = Carrier(osc, single_stepper(osc, Flow.HAMILTONIAN_VARIATIONAL), pieces)
    try:
        chain = priced_chain(carrier, 0, candidate.states)
    except StructureError:
        return 0.0
    exact = price(carrier, 0, chain.points)
    return abs(exact - chain.action) if np.isfinite(exact) else 0.0
