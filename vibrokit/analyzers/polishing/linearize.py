"""Linearize Hamilton's equations along a closed orbit: here at its nodes, or as a limit cycle."""

from __future__ import annotations

import dataclasses
import itertools
import math
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.polishing.linear_spaces import (
    carried_along,
    carried_around,
    check_hyperbolic,
    extended,
    invariant_spaces,
    scale_of,
)
from vibrokit.analyzers.polishing.linearized_cycle import linearized_cycle
from vibrokit.analyzers.polishing.linearized_orbit import LinearizedOrbit, OrbitDisplacement, adjoint_weights
from vibrokit.errors import StructureError
from vibrokit.structure.linear_map import GaussianMap, gaussian_map
from vibrokit.structure.orbits import multipliers_of, refine_orbit, states_along

Array = NDArray[np.float64]


def linearized_orbit(propagator: SegmentPropagator, nodes: Array, period: int, duration: float) -> LinearizedOrbit:
    """Linearize Hamilton's equations along an orbit, an equilibrium, or a limit cycle, of any stability.

    Parameters
    ----------
    propagator : SegmentPropagator
    nodes : array (count, n)
        One of its points on the section, or several states at equal times from such a point on; they are refined.
    period : int
        In section intervals; 0 and 1 are the same.
    duration : float
        Time after which it repeats (s); 0 for an equilibrium.

    Raises
    ------
    StructureError
        There is no such orbit near the nodes, or it is not hyperbolic.
    """
    if propagator.osc.autonomous and duration > 0:
        return linearized_cycle(propagator, nodes[0], duration)
    return _at_nodes(propagator, nodes, max(1, period))


@dataclasses.dataclass(frozen=True, eq=False)
class LinearizedAtNodes(LinearizedOrbit):
    """A periodic orbit or an equilibrium: it repeats after a whole number of pieces."""

    states: Array  # (nodes, n): the orbit at each node, from the section on
    linear: GaussianMap  # M and C of the pieces that begin at the nodes
    unstable: Array  # (nodes, 2n, n)
    stable: Array  # (nodes, 2n, n)

    @property
    def period_nodes(self) -> int:
        return len(self.states)

    @property
    def slowest_rate(self) -> float:
        return float(np.abs(np.log(np.abs(self.multipliers))).min()) / len(self.states)

    def with_start_on_orbit(self) -> Self:
        size = self.states.shape[1]
        free = np.vstack([np.zeros((size, size)), np.eye(size)])
        return dataclasses.replace(self, unstable=np.broadcast_to(free, self.unstable.shape), start_on_orbit=True)

    def node(self, phase: int) -> int:
        return phase % len(self.states)

    def along(self, first: int, count: int) -> Array:
        return self.states[(first + np.arange(count)) % len(self.states)]

    def space_at(self, phase: int, *, leaving: bool) -> Array:
        return (self.unstable if leaving else self.stable)[self.node(phase)]

    def step(self, phase: int) -> Array:
        return extended(self.linear.derivatives[self.node(phase)], self.linear.covariances[self.node(phase)])

    def carried(self, phase: int, *, leaving: bool) -> Array:
        return self._carried[self.node(phase), leaving]

    @cached_property
    def _carried(self) -> dict[tuple[int, bool], Array]:
        both = itertools.product(range(len(self.states)), (True, False))
        return {(node, side): super(LinearizedAtNodes, self).carried(node, leaving=side) for node, side in both}

    def nearest(self, states: Array, phases: NDArray[np.intp]) -> tuple[Array, Array]:
        places = (phases[:, None] + np.arange(0, len(self.states), self.propagator.pieces)) % len(self.states)
        distances = np.linalg.norm((states[:, None] - self.states[places]) / self.propagator.units, axis=2)
        distances = np.where(np.isfinite(distances), distances, np.inf)
        each, best = np.arange(len(states)), np.argmin(distances, axis=1)
        return distances[each, best], places[each, best]

    def starting(self, place: float) -> tuple[Self, int]:
        return self, int(place)

    def through(self, point: Array, phase: int, *, leaving: bool) -> Self:
        return self

    def again(self, propagator: SegmentPropagator) -> LinearizedAtNodes:
        found = _at_nodes(propagator, self.states, len(self.states) // propagator.pieces)
        return found.with_start_on_orbit() if self.start_on_orbit else found

    def displacement(self, phase: int, momentum: Array) -> OrbitDisplacement:
        phases = (phase + np.arange(len(self.states))) % len(self.states)
        weights = adjoint_weights(self.linear.derivatives[phases], momentum)
        return OrbitDisplacement(self.states[phases], np.roll(self.states, -1, axis=0)[phases], weights, phases, None)


def _at_nodes(propagator: SegmentPropagator, guess: Array, period: int) -> LinearizedAtNodes:
    """Linearize along an orbit that repeats after some section intervals; the guess (count, n) is refined.

    From the section, the spaces are carried to the other nodes, the unstable one forward and the stable one backward:
    in these directions they attract.
    """
    osc, stepper, pieces = propagator.osc, propagator.stepper, propagator.pieces
    nodes = refine_orbit(osc, guess, period, stepper).nodes if len(guess) == 1 else guess
    states = refine_orbit(osc, states_along(osc, nodes, period, stepper, pieces), period, stepper).nodes
    linear = gaussian_map(osc, states, stepper, interval=osc.section_interval / pieces, phases=np.arange(len(states)))
    if not np.isfinite(linear.derivatives).all():
        place = tuple(np.round(states[0], 6).tolist())
        raise StructureError(f"{stepper} does not carry deviations along the orbit through {place}: it is too stiff.")
    multipliers = multipliers_of(linear.derivatives)
    check_hyperbolic(states[0], multipliers)
    unstable, stable = _spaces(linear, multipliers, propagator)
    return LinearizedAtNodes(propagator, multipliers, states, linear, unstable, stable)


def _spaces(
    linear: GaussianMap, multipliers: NDArray[np.complex128], propagator: SegmentPropagator
) -> tuple[Array, Array]:
    """The unstable and the stable space at all nodes.

    At the first node they are invariant spaces of the map over the whole orbit. Where a multiplier is above e¹⁶, that
    map has fewer than nine digits for the others; there almost any two spaces turn into them while they are carried
    along the orbit, until a wrong part has shrunk by e⁻⁴⁰.
    """
    n = linear.images.shape[1]
    logarithms = np.log(np.abs(multipliers))
    if logarithms.max() < 16.0:
        monodromy, covariance = linear.composed()
        spaces = invariant_spaces(monodromy, covariance, np.empty((n, 0)))
        return carried_along(linear, *spaces, scale_of(propagator, covariance))
    turns = math.ceil(40.0 / (2 * float(np.abs(logarithms).min())))
    scale = scale_of(propagator, linear.covariances.sum(axis=0))
    return carried_around(linear, turns, scale)
