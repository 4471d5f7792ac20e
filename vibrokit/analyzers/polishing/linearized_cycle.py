"""LinearizedCycle: a limit cycle, with Hamilton's equations linearized along it, seen from any time on."""

from __future__ import annotations

import dataclasses
import math
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.polishing.linear_spaces import (
    carried_along,
    check_hyperbolic,
    extended,
    invariant_spaces,
    normalized,
    scale_of,
)
from vibrokit.analyzers.polishing.linearized_orbit import LinearizedOrbit, OrbitDisplacement, adjoint_weights
from vibrokit.kernels.vector_field import VectorField
from vibrokit.structure.autonomous import Cycle, refine_cycle
from vibrokit.structure.linear_map import GaussianMap, gaussian_map, gaussian_pieces

_NODES = 512  # along a cycle: a polyline through them is within about 2e-5 of its extent from it
_SAME_TIME = 1e-13  # of the duration

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class LinearizedCycle(LinearizedOrbit):
    """A limit cycle. Its duration is no whole number of pieces, and `start` is the time on it that phase 0 stands for.

    Paths that leave or approach it may be shifted in time, so that both spaces contain the direction of the motion, as
    their first vector. The condition on a point is that at the time with which it keeps in step: `through` shifts the
    cycle to it.
    """

    neutral: ClassVar[int] = 1

    cycle: Cycle
    states: Array  # (nodes, n): at equal times, from the turning point on
    unstable: Array  # (nodes, 2n, n)
    stable: Array  # (nodes, 2n, n)
    scale: Array  # (2n,): sizes of (q, p) that belong together
    start: float = 0.0  # s

    @property
    def period_nodes(self) -> int:
        return math.ceil(self.cycle.duration / self.propagator.piece)

    @property
    def slowest_rate(self) -> float:
        return float(np.abs(np.log(np.abs(_without_shift(self.multipliers)))).min()) * (
            self.propagator.piece / self.cycle.duration
        )

    def node(self, phase: int) -> int:
        return 0

    def along(self, first: int, count: int) -> Array:
        states = [self._from_node(phase)[1].images[0] for phase in range(first, first + count)]
        return np.array(states).reshape(count, self.states.shape[1])

    def space_at(self, phase: int, *, leaving: bool) -> Array:
        """Carried to the phase from the node before."""
        node, moved = self._from_node(phase)
        space = (self.unstable if leaving else self.stable)[node]
        return normalized(extended(moved.derivatives[0], moved.covariances[0]) @ space, self.scale, self.neutral)

    def step(self, phase: int) -> Array:
        (state,) = self.along(phase, 1)
        moved = self._moved(state, self.propagator.piece)
        return extended(moved.derivatives[0], moved.covariances[0])

    def nearest(self, states: Array, phases: NDArray[np.intp]) -> tuple[Array, Array]:
        """Distances from a polyline through the nodes, and times on the cycle."""
        units = self.propagator.units
        nodes = np.vstack([self.states, self.states[:1]]) / units
        ways = np.diff(nodes, axis=0)
        along = np.einsum("akj,kj->ak", states[:, None] / units - nodes[:-1], ways) / (ways**2).sum(axis=1)
        along = np.clip(along, 0.0, 1.0)
        distances = np.linalg.norm(states[:, None] / units - nodes[:-1] - along[..., None] * ways, axis=2)
        distances = np.where(np.isfinite(distances), distances, np.inf)
        node, each = np.argmin(distances, axis=1), np.arange(len(states))
        return distances[each, node], (node + along[each, node]) * self._spacing

    def starting(self, place: float) -> tuple[Self, int]:
        return dataclasses.replace(self, start=float(place)), 0

    def through(self, point: Array, phase: int, *, leaving: bool) -> Self:
        moved = self
        for _ in range(8):  # each gains the ratio of the distance to the radius of curvature
            shift = float(moved._ahead(phase, leaving=leaving) @ (point - moved.point(phase)))
            if not math.isfinite(shift):
                return self
            moved = dataclasses.replace(moved, start=(moved.start + shift) % self.cycle.duration)
            if abs(shift) < _SAME_TIME * self.cycle.duration:
                break
        return moved

    def again(self, propagator: SegmentPropagator) -> LinearizedCycle:
        found = linearized_cycle(propagator, self.cycle.point, self.cycle.duration)
        start = self.start * found.cycle.duration / self.cycle.duration
        return dataclasses.replace(found, start=start)

    def conditions(self, phase: int, scale: Array, *, leaving: bool) -> Array:
        """By the symplectic form, which is 0 between any two vectors of such a space; smooth in time."""
        basis, n = self.space_at(phase, leaving=leaving), len(scale) // 2
        rows: Array = np.vstack([basis[n:], -basis[:n]]).T * scale
        return rows / np.linalg.norm(rows, axis=1)[:, None]

    def misfit_derivatives(self, point: Array, phase: int, scale: Array, *, leaving: bool) -> Array:
        """With the conditions, as the time changes with which the point keeps in step.

        Where manifolds meet at an angle as small as the distance from the cycle, the change of the conditions counts.
        """
        normals = self.conditions(phase, scale, leaving=leaving)
        short = 1e-4 * self.cycle.duration
        before, after = (
            dataclasses.replace(self, start=self.start + shift).conditions(phase, scale, leaving=leaving)
            for shift in (-short, short)
        )
        turning = (after - before) @ ((point - self.point(phase)) / scale) / (2 * short)
        return normals + np.outer(turning, self._ahead(phase, leaving=leaving) * scale)

    def _ahead(self, phase: int, *, leaving: bool) -> Array:
        """The derivative (2n,) in a point of the time by which it is ahead of the phase."""
        basis, n = self.space_at(phase, leaving=leaving), len(self.scale) // 2
        rate = VectorField(self.propagator.osc).rate(self.along(phase, 1)[0])
        shares = np.linalg.pinv(basis / self.scale[:, None])[0] / self.scale
        return np.asarray(shares / np.linalg.norm(rate / self.scale[:n]), dtype=np.float64)

    def displacement(self, phase: int, momentum: Array) -> OrbitDisplacement:
        """From the state at the phase on; the last piece of the cycle ends there."""
        (state,) = self.along(phase, 1)
        states, linear = gaussian_pieces(
            self.propagator.osc, state, self.propagator.stepper, _NODES, _NODES, self.cycle.duration
        )
        weights = adjoint_weights(linear.derivatives, momentum, VectorField(self.propagator.osc).rate(state))
        still = np.zeros(_NODES, dtype=np.int64)
        return OrbitDisplacement(states[:-1], states[1:], weights, still, self.cycle.duration / _NODES)

    @property
    def _spacing(self) -> float:
        """Time from node to node (s)."""
        return self.cycle.duration / len(self.states)

    def _from_node(self, phase: int) -> tuple[int, GaussianMap]:
        """The node before a phase, and the map from there to the phase."""
        time = (self.start + phase * self.propagator.piece) % self.cycle.duration
        node = min(int(time / self._spacing), len(self.states) - 1)
        return node, self._moved(self.states[node], time - node * self._spacing)

    def _moved(self, state: Array, duration: float) -> GaussianMap:
        if duration <= _SAME_TIME * self.cycle.duration:
            size = len(state)
            return GaussianMap(state[None], np.eye(size)[None], np.zeros((1, size, size)))
        return gaussian_map(self.propagator.osc, state[None], self.propagator.stepper, interval=duration)


def linearized_cycle(propagator: SegmentPropagator, point: Array, duration: float) -> LinearizedCycle:
    """Linearize Hamilton's equations along a limit cycle of any stability.

    The turning point (n,) and the duration (s) are refined. Raises StructureError if there is no cycle, or if a
    multiplier besides that of a shift in time has the size 1.
    """
    osc, stepper = propagator.osc, propagator.stepper
    cycle = refine_cycle(osc, point, duration, stepper)
    states, linear = gaussian_pieces(osc, cycle.point, stepper, _NODES, _NODES, cycle.duration)
    monodromy, covariance = linear.composed()
    multipliers = np.linalg.eigvals(monodromy).astype(complex)
    check_hyperbolic(cycle.point, _without_shift(multipliers))
    spaces = invariant_spaces(monodromy, covariance, VectorField(osc).rate(cycle.point)[:, None])
    scale = scale_of(propagator, covariance)
    unstable, stable = carried_along(linear, *spaces, scale, LinearizedCycle.neutral)
    return LinearizedCycle(propagator, multipliers, cycle, states[:-1], unstable, stable, scale)


def _without_shift(multipliers: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Return the multipliers of a limit cycle less that of a shift in time, which is 1."""
    return np.delete(multipliers, np.argmin(np.abs(multipliers - 1)))
