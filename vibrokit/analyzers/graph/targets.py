"""Exit targets: where paths of the graph end, what it costs to get there, and where paths are traced back from."""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod

import numpy as np
import scipy.optimize
from numpy.typing import NDArray

from vibrokit.analyzers.graph.potential import Potential
from vibrokit.analyzers.graph.step_model import StepModel
from vibrokit.kernels.sweeps import descend_all

_BEYOND = (1.5, 3.0)  # nodes from a saddle to where paths over it are traced back from
_PARTS = 8  # of a step, at whose ends the face is evaluated before the minimum is refined
_PER_NODE = 2  # states on the face for each node along it

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclasses.dataclass(frozen=True, eq=False)
class TraceStart:
    """A state that a path is traced back from."""

    state: Array  # (2,)
    phase: int = 0
    beyond: Array = dataclasses.field(default_factory=lambda: np.empty((0, 2)))  # the state on a face that follows
    last: float | None = None  # time until then (s)
    free: Mask | None = None  # (2,): which of its coordinates may be any


@dataclasses.dataclass(frozen=True, eq=False)
class Arrival:
    """An exit target on one potential."""

    value: float  # least V of the target; infinite if the grid does not reach it
    error: float = 0.0  # what the place of the target alone contributes to the error of the value
    starts: tuple[TraceStart, ...] = ()
    place: TraceStart | None = None  # where V is least, if the target is a set of states on the section


@dataclasses.dataclass(frozen=True, eq=False)
class ExitTarget(ABC):
    """A set of states that an exit path ends on. Abstract."""

    labels: tuple[int, ...]  # of the attractors that are reached from there; −1 for another exit, −2 for escape
    saddle: int  # which of the structure's saddles it is; −1 for none
    scale: float  # rough cost of a straight path, from which the search for the ceiling of V starts

    @property
    def farther(self) -> bool:
        """Whether paths to it may pass basins of other attractors."""
        return False

    @property
    def is_sharp(self) -> bool:
        """Whether a path that ends on it has reached the exit; if not, motion without noise from its end shows that."""
        return True

    @property
    def places(self) -> Array:
        """States on the section that a grid has to cover, shape (count, 2)."""
        return np.empty((0, 2))

    @abstractmethod
    def evaluate(self, potential: Potential) -> Arrival:
        """Return what reaching the target costs, and where paths to it are traced back from."""


@dataclasses.dataclass(frozen=True, eq=False)
class StateTarget(ExitTarget):
    """Any of some states on the section."""

    states: Array  # (count, 2)
    direction: Array | None = None  # (2,): of the unstable manifold at the first state, if that is a saddle
    depth: Array | None = None  # (2,): how far, in x and in v, the states lie behind the basin boundary; None: on it

    @property
    def farther(self) -> bool:
        """Whether it is a basin: a saddle on the boundary of the own basin is reached before any other basin."""
        return self.depth is not None

    @property
    def is_sharp(self) -> bool:
        """Whether paths end on its states, and not just beyond a saddle or behind a basin boundary."""
        return self.direction is None and self.depth is None

    @property
    def places(self) -> Array:
        """Its states: a saddle may lie outside the region."""
        return self.states

    def evaluate(self, potential: Potential) -> Arrival:
        """The cheapest state.

        From a set, which is some nodes thick on the grid, the error is how V rises near that state; behind a boundary
        it is how V falls towards the boundary.
        """
        values = np.array([potential.at(phase, self.states) for phase in potential.grids.sections])
        if not np.isfinite(values).any():
            return Arrival(np.inf)
        section, best = np.unravel_index(int(np.nanargmin(values)), values.shape)
        phase, cheapest = potential.grids.sections[section], self.states[best]
        place = TraceStart(cheapest, phase)
        error = 0.0 if len(potential.orbit) else potential.rise(phase, cheapest)
        if self.depth is not None:
            error += max(0.0, potential.fall(phase, cheapest, self.depth))
        if self.direction is not None and np.isfinite(values[:, 0]).any():  # the saddle's point of that direction
            phase = potential.grids.sections[int(np.nanargmin(values[:, 0]))]
        return Arrival(float(values[section, best]), error, self._starts(potential, phase, cheapest), place)

    def _starts(self, potential: Potential, phase: int, cheapest: Array) -> tuple[TraceStart, ...]:
        """The cheapest state, or some just beyond a saddle, on the side that a path from the source comes to last."""
        if self.direction is None:
            return (TraceStart(cheapest, phase),)
        step = self.direction / np.max(np.abs(self.direction) / potential.grids.spacing(phase))
        sides = np.array([step, -step])
        values = potential.at(phase, self.states[0] + _BEYOND[0] * sides)
        side = sides[int(np.nanargmax(values))] if np.isfinite(values).any() else step
        return tuple(TraceStart(self.states[0] + beyond * side, phase) for beyond in _BEYOND)


@dataclasses.dataclass(frozen=True, eq=False)
class FaceTarget(ExitTarget):
    """The states with one coordinate at a given level.

    A path may reach the face between two phases and between two nodes: V is advanced from each phase by parts of a
    step, to states on the face.
    """

    model: StepModel
    axis: int  # 0 for a level of x, 1 for a level of v
    level: float

    def evaluate(self, potential: Potential) -> Arrival:
        """The cheapest state over all times; paths are traced back from the phase before."""
        grids, free = potential.grids, 1 - self.axis
        best = (np.inf, 0, grids.step, 0.0)
        for phase in range(grids.phases):
            low, high = grids.boxes[phase, free]
            along = np.linspace(low, high, _PER_NODE * grids.shape[free])
            for part in range(1, _PARTS + 1):
                duration = grids.step * part / _PARTS
                costs, _ = self._costs(potential, phase, duration, along)
                index = int(np.argmin(costs))
                if costs[index] < best[0]:
                    best = (float(costs[index]), phase, duration, float(along[index]))
        if not np.isfinite(best[0]):
            return Arrival(np.inf)
        value, phase, duration, place = self._refined(potential, *best[1:])
        _, predecessors = self._costs(potential, phase, duration, np.array([place]))
        start = grids.states(phase, predecessors[0])
        beyond, free = self._on_face(np.array([place])), np.arange(2) != self.axis
        return Arrival(value, 0.0, (TraceStart(start, phase, beyond, duration, free),))

    def _refined(
        self, potential: Potential, phase: int, duration: float, place: float
    ) -> tuple[float, int, float, float]:
        """The least cost near a state on the face, with its phase, duration and place."""
        grids = potential.grids
        middle = np.array([duration, place])
        apart = np.array([grids.step / _PARTS, grids.spacing(phase)[1 - self.axis] / _PER_NODE])

        def cost(shifts: Array) -> float:
            when, where = middle + shifts * apart
            if not 0.01 * grids.step <= when <= grids.step:  # the covariance of a shorter one is close to singular
                return np.inf
            return float(self._costs(potential, phase, when, np.array([where]))[0][0])

        simplex = np.array([(0.0, 0.0), (-0.5, 0.5), (0.5, 0.5)])
        # The cost is quadratic there: 1e-3 of these distances is enough, and takes some 40 iterations.
        options = {"initial_simplex": simplex, "maxiter": 60, "xatol": 1e-3, "fatol": 0.0}
        found = scipy.optimize.minimize(cost, simplex[0], method="Nelder-Mead", options=options)
        duration, place = middle + found.x * apart
        return float(found.fun), phase, float(duration), float(place)

    def _costs(self, potential: Potential, phase: int, duration: float, along: Array) -> tuple[Array, Array]:
        """Costs of being at places along the face some time after a phase, and the predecessors at that phase."""
        costs = self.model.into(self._on_face(along), potential.grids, phase, duration)
        tries = np.stack([costs.centres, costs.uphill], axis=1)
        return descend_all(potential.values[phase], tries, costs.centres, costs.roots, 1.0)

    def _on_face(self, along: Array) -> Array:
        level = np.full(len(along), self.level)
        return np.column_stack([level, along] if self.axis == 0 else [along, level])
