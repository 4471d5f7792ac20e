"""Exit targets: where paths of the graph end, what it costs to get there, and where paths are traced back from."""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.graph.potential import Potential

_BEYOND = (1.5, 3.0)  # nodes from a saddle to where paths over it are traced back from

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class TraceStart:
    """A state that a path is traced back from."""

    state: Array  # (2,)
    phase: int = 0
    beyond: Array = dataclasses.field(default_factory=lambda: np.empty((0, 2)))  # states that follow, one in each step


@dataclasses.dataclass(frozen=True, eq=False)
class Arrival:
    """An exit target on one potential."""

    value: float  # least V of the target; infinite if the grid does not reach it
    error: float = 0.0  # what the place of the target alone contributes to the error of the value
    starts: tuple[TraceStart, ...] = ()


@dataclasses.dataclass(frozen=True, eq=False)
class ExitTarget(ABC):
    """A set of states that an exit path ends on. Abstract."""

    label: int  # label of the attractor that is reached from there; −1 for an exit that is no attractor
    saddle: int  # which of the structure's saddles it is; −1 for none
    scale: float  # rough cost of a straight path, from which the search for the ceiling of V starts

    @abstractmethod
    def evaluate(self, potential: Potential) -> Arrival:
        """Return what reaching the target costs, and where paths to it are traced back from."""


@dataclasses.dataclass(frozen=True, eq=False)
class StateTarget(ExitTarget):
    """Any of some states on the section."""

    states: Array  # (count, 2)
    direction: Array | None = None  # (2,): of the unstable manifold at the first state, if that is a saddle
    depth: Array | None = None  # (2,): how far, in x and in v, the states lie behind the basin boundary; None: on it

    def evaluate(self, potential: Potential) -> Arrival:
        """The cheapest state.

        From a set, which is some nodes thick on the grid, the error is how V rises near that state; behind a boundary
        it is how V falls towards the boundary.
        """
        values = potential.at(0, self.states)
        if not np.isfinite(values).any():
            return Arrival(np.inf)
        best = int(np.nanargmin(values))
        cheapest = self.states[best]
        error = 0.0 if len(potential.orbit) else potential.rise(0, cheapest)
        if self.depth is not None:
            error += max(0.0, potential.fall(0, cheapest, self.depth))
        return Arrival(float(values[best]), error, self._starts(potential, cheapest))

    def _starts(self, potential: Potential, cheapest: Array) -> tuple[TraceStart, ...]:
        """The cheapest state, or some just beyond a saddle, on the side that a path from the source comes to last."""
        if self.direction is None:
            return (TraceStart(cheapest),)
        step = self.direction / np.max(np.abs(self.direction) / potential.grids.spacing(0))
        sides = np.array([step, -step])
        values = potential.at(0, self.states[0] + _BEYOND[0] * sides)
        side = sides[int(np.nanargmax(values))] if np.isfinite(values).any() else step
        return tuple(TraceStart(self.states[0] + beyond * side) for beyond in _BEYOND)
