"""Ways followed: the paths by which a graph reaches a way out, made smooth and priced by Hamilton's equations."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.candidate import Candidate
from vibrokit.analyzers.polishing.carrier import Carrier
from vibrokit.analyzers.polishing.chain import smooth_chain
from vibrokit.analyzers.polishing.relaxing import relaxed_between
from vibrokit.analyzers.screening.paths import follow_back
from vibrokit.analyzers.screening.potential import Potential
from vibrokit.analyzers.screening.ways_out import Tip, Way
from vibrokit.errors import StructureError
from vibrokit.kernels.choice import single_stepper
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.symbolic.flow_kind import Flow

_FINDER = "graph"
_SHORTEST = 3
_ALIKE = 1e-4  # relative difference of prices of paths that are taken for one

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class WayFollowed:
    """A path to a way out, brought down to a local minimum of the action.

    Attributes
    ----------
    candidate : Candidate
        Its action is what Hamilton's equations price it at, so that, but for the quadratic form that it starts in, it
        bounds the least action from above.
    quadratic : float
        Its price as the graph has it, its steps linearised.
    """

    candidate: Candidate
    quadratic: float

    @property
    def linearising(self) -> float:
        """By how much, relative, linearising over a step changed the price."""
        return abs(self.quadratic - self.candidate.action) / self.candidate.action


class Follower:
    """Follows paths from an attractor to ways out, on each potential once."""

    def __init__(self, osc: Oscillator, stepper: Stepper, source: int) -> None:
        self.osc, self.stepper, self.source = osc, stepper, source
        self._known: dict[tuple[Potential, Way], list[WayFollowed]] = {}

    def follow(self, potential: Potential, way: Way) -> list[WayFollowed]:
        """Return the different paths that a potential has to a way out, the cheapest first."""
        if (potential, way) not in self._known:
            self._known[potential, way] = self._followed(potential, way)
        return self._known[potential, way]

    def _followed(self, potential: Potential, way: Way) -> list[WayFollowed]:
        if not np.isfinite(way.cost(potential)):
            return []
        found = [_one(self.osc, self.stepper, potential, way, tip, self.source) for tip in way.tips(potential)]
        return different(one for one in found if one is not None)


def different(found: Iterable[WayFollowed]) -> list[WayFollowed]:
    """Return each path once, the cheapest first."""
    kept: list[WayFollowed] = []
    for one in sorted(found, key=lambda each: each.candidate.action):
        action = one.candidate.action
        if not any(abs(action - other.candidate.action) <= _ALIKE * action for other in kept):
            kept.append(one)
    return kept


def _one(
    osc: Oscillator, stepper: Stepper, potential: Potential, way: Way, tip: Tip, source: int
) -> WayFollowed | None:
    path = follow_back(osc, stepper, potential, tip.state, tip.phase)
    if path is None or len(path.states) < _SHORTEST:
        return None
    pieces = round(osc.section_interval / potential.grids.step)
    carrier = Carrier(osc, single_stepper(osc, Flow.HAMILTONIAN_VARIATIONAL), pieces)
    try:
        chain = smooth_chain(carrier, 0, path.states)
    except StructureError:
        return None
    states, action = relaxed_between(carrier, 0, chain.points)
    if not np.isfinite(action):
        return None
    head = float(path.level[0])
    if len(tip.beyond):
        head += max(0.0, way.cost(potential) - float(potential.at(tip.phase, tip.state[None])[0]))
    states = np.concatenate([states, tip.beyond])
    times: Array = potential.grids.step * np.arange(len(states), dtype=float)
    return WayFollowed(Candidate(source, way.target, times, states, head + action, _FINDER), head + chain.action)
