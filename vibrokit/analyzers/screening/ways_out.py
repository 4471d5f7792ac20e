"""Ways out: what a path from an attractor may come to, and what that costs."""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.screening.grids import Grids
from vibrokit.analyzers.screening.potential import Potential
from vibrokit.analyzers.screening.tables import carried, forward
from vibrokit.errors import StructureError
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.results.saddle import Saddle
from vibrokit.results.structure import Structure
from vibrokit.structure.basins.sharing import agreeing
from vibrokit.structure.orbits import section_derivative

_INSIDE = 2  # cells of the basins, from the boundary to the nearest that counts as surely inside
_BEYOND = (1.5, 3.0)  # cells from a saddle to where paths over it are begun

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class Tip:
    """End of a path on the grid.

    Attributes
    ----------
    state : array (2,)
    phase : int
    beyond : array (count, 2)
        States that follow, one step of time after another.
    """

    state: Array
    phase: int = 0
    beyond: Array = dataclasses.field(default_factory=lambda: np.empty((0, 2)))


@dataclasses.dataclass(frozen=True, eq=False)
class Way(ABC):
    """A way out. Abstract.

    Attributes
    ----------
    target : int
        Label of the attractor that it leads to; −1 where that is not said.
    saddle : int
        Place of its saddle in the structure; −1 for none.
    bound : float
        What going straight there would cost, roughly: a scale to begin with.
    """

    target: int
    saddle: int
    bound: float

    @abstractmethod
    def cost(self, potential: Potential) -> float:
        """Return the least V of the way out; NaN where the grid does not reach there."""

    def blur(self, potential: Potential) -> float:
        """Return how far the cost is uncertain where the source is a set, on the grid some cells thick; 0 if not."""
        return 0.0

    def beyond(self, potential: Potential) -> float:
        """Return by how much the cost is too high because the way out is known a little beyond the boundary only."""
        return 0.0

    @abstractmethod
    def tips(self, potential: Potential) -> list[Tip]:
        """Return from where paths are followed back."""


@dataclasses.dataclass(frozen=True, eq=False)
class Places(Way):
    """A way out by any of some states on the section.

    Attributes
    ----------
    states : array (count, 2)
    direction : array (2,), optional
        Of the unstable manifold at the first of them.
    room : array (2,), optional
        How far beyond the boundary the states may lie, in x and in v; by default on it.
    """

    states: Array
    direction: Array | None = None
    room: Array | None = None

    def cost(self, potential: Potential) -> float:
        """The least V."""
        return _least(potential.at(0, self.states))

    def blur(self, potential: Potential) -> float:
        """How V rises near the cheapest state."""
        return potential.blur(0, self.states[_first(potential.at(0, self.states))])

    def beyond(self, potential: Potential) -> float:
        """How far V falls towards the boundary from the cheapest state."""
        if self.room is None:
            return 0.0
        return max(0.0, potential.fall(0, self.states[_first(potential.at(0, self.states))], self.room))

    def tips(self, potential: Potential) -> list[Tip]:
        """The cheapest state, or some just beyond a saddle, where V no longer falls."""
        if self.direction is None:
            return [Tip(self.states[_first(potential.at(0, self.states))])]
        step = self.direction / np.max(np.abs(self.direction) / potential.grids.spacing(0))
        sides = np.array([step, -step])
        side = sides[_first(-potential.at(0, self.states[0] + _BEYOND[0] * sides))]
        return [Tip(self.states[0] + beyond * side) for beyond in _BEYOND]


def ways_to_leave(osc: Oscillator, structure: Structure, attractor: Attractor, stepper: Stepper) -> list[Way]:
    """Return the saddles on the boundary of an attractor's basin, and the basins that no saddle leads to."""
    ways: list[Way] = []
    for index, saddle in enumerate(structure.saddles):
        others = [label for label in saddle.leads_to if label >= 0 and label != attractor.label]
        if attractor.label in saddle.leads_to and others:
            states = saddle.points[:, :2]
            bound = straight(osc, stepper, attractor, states)
            ways.append(Places(others[0], index, bound, states, _direction(osc, stepper, saddle)))
    reached = {way.target for way in ways}
    sure = np.where(agreeing(structure.basins.labels, 1), structure.basins.labels, -1).ravel()
    region, shape = structure.basins.region, structure.basins.labels.shape
    centres = region.cell_centres(shape)
    room = _INSIDE * np.diff(region.bounds, axis=1)[:, 0] / shape
    for other in structure.attractors:
        if other.label != attractor.label and other.label not in reached:
            inside = np.concatenate([centres[sure == other.label], other.points[:, :2]])
            bound = straight(osc, stepper, attractor, other.points[:, :2])
            ways.append(Places(other.label, -1, bound, inside, room=room))
    return ways


def straight(osc: Oscillator, stepper: Stepper, attractor: Attractor, states: Array) -> float:
    """Return the quadratic price of going from the attractor to the cheapest of some states in one section interval."""
    images, _, gramians = forward(osc, stepper, attractor.points[:1, :2], 0.0, osc.section_interval)
    miss = states - images[0]
    found = float(np.min(0.5 * np.einsum("ni,ij,nj->n", miss, np.linalg.pinv(gramians[0]), miss)))
    free = float(osc.natural_frequency**3 * np.min(np.sum((miss * [1.0, 1 / osc.natural_frequency]) ** 2, axis=1)))
    return found if np.isfinite(found) and found > 0 else free  # pressed against a stiff stop noise moves nothing


def home(
    osc: Oscillator, structure: Structure, attractor: Attractor, stepper: Stepper, grids: Grids, phase: int
) -> NDArray[np.bool_]:
    """Return which nodes of a phase lead to an attractor, as the basins on the section tell."""
    states = grids.nodes(phase).reshape(-1, 2)
    if phase:
        states = carried(osc, stepper, states, grids.time(phase), osc.section_interval - grids.time(phase))
    basins = structure.basins
    low, high = basins.region.bounds.T
    shares = (states - low) / (high - low)
    inside = np.all((shares >= 0) & (shares < 1), axis=1)
    cells = np.where(inside[:, None], shares * basins.labels.shape, 0).astype(np.int64)
    mask: NDArray[np.bool_] = inside & (basins.labels[cells[:, 0], cells[:, 1]] == attractor.label)
    return mask.reshape(grids.cells)


def _direction(osc: Oscillator, stepper: Stepper, saddle: Saddle) -> Array | None:
    if saddle.kind == "chaotic":
        return None
    try:
        _, slopes = section_derivative(osc, saddle.points[0], max(1, saddle.period), stepper)
    except StructureError:
        return None
    values, vectors = np.linalg.eig(slopes)
    direction: Array = np.real(vectors[:2, int(np.argmax(np.abs(values)))])
    return direction


def _first(costs: Array) -> int:
    return int(np.nanargmin(costs)) if np.isfinite(costs).any() else 0


def _least(costs: Array) -> float:
    return float(np.nanmin(costs)) if np.isfinite(costs).any() else float("nan")
