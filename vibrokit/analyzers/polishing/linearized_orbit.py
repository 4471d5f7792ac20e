"""LinearizedOrbit: an orbit of the noise-free motion, with Hamilton's equations linearized along it."""

from __future__ import annotations

import dataclasses
import itertools
import math
from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.polishing.linear_spaces import normals_of
from vibrokit.errors import StructureError
from vibrokit.structure.linear_map import hamiltonian_map

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class OrbitDisplacement:
    """What the pieces of a closed orbit contribute to p·dq, q the orbit at one phase."""

    states: Array  # (pieces, n): where the pieces begin
    images: Array  # (pieces, n): where they end
    weights: Array  # (pieces, n): derivatives of p·q in the images of the pieces
    phases: NDArray[np.int64]  # (pieces,): since the section
    interval: float | None  # duration of a piece (s); None: that of the propagator

    def offsets(self, propagator: SegmentPropagator) -> Array:
        """Return the changes of the images with another propagator, in a scene that differs."""
        n = self.states.shape[1]
        interval = propagator.piece if self.interval is None else self.interval
        at_rest = np.pad(self.states, ((0, 0), (0, n)))
        found = hamiltonian_map(
            propagator.osc, at_rest, propagator.stepper, interval=interval, phases=self.phases % propagator.pieces
        )
        return found.images[:, :n] - self.images


@dataclasses.dataclass(frozen=True, eq=False)
class LinearizedOrbit(ABC):
    """A hyperbolic orbit at p = 0, and the linear spaces in which extremal paths leave and approach it. Abstract.

    Over a time the linearized equations are E = [[M, C M⁻ᵀ], [0, M⁻ᵀ]]. Both spaces have n of the 2n dimensions. Phases
    are whole numbers of pieces.
    """

    neutral: ClassVar[int] = 0  # number of neutral vectors in both spaces, the first ones of their bases

    propagator: SegmentPropagator
    multipliers: NDArray[np.complex128]  # (n,), of a period
    start_on_orbit: bool = dataclasses.field(default=False, kw_only=True)
    """Whether paths start on the orbit itself, at p ≠ 0, instead of in the unstable space."""

    @property
    @abstractmethod
    def period_nodes(self) -> int:
        """Nodes in a period, rounded up."""

    @property
    @abstractmethod
    def slowest_rate(self) -> float:
        """Slowest rate, per piece, at which paths leave or approach."""

    def with_start_on_orbit(self) -> Self | None:
        """Return the same orbit, left by paths that start on it; None if none do.

        It serves orbits around which the linearized equations hold in too small a neighborhood. Such a path takes a
        finite time, so that it costs more than the least action; the longer it is, the less.
        """
        return None

    @abstractmethod
    def node(self, phase: int) -> int:
        """Return a number that is the same at phases where the orbit is left in the same way."""

    @abstractmethod
    def along(self, first: int, count: int) -> Array:
        """Return the states (count, n) at consecutive phases."""

    @abstractmethod
    def space_at(self, phase: int, *, leaving: bool) -> Array:
        """Return a basis (2n, n) of the unstable space of (δq, p), in which paths leave, or of the stable one."""

    @abstractmethod
    def step(self, phase: int) -> Array:
        """Return E over the piece that begins at a phase."""

    @abstractmethod
    def nearest(self, states: Array, phases: NDArray[np.intp]) -> tuple[Array, Array]:
        """Return the distance of each state (count, n), and where it is measured, for `starting`.

        The phases (count,) of the states are in pieces since the section.
        """

    @abstractmethod
    def starting(self, place: float) -> tuple[Self, int]:
        """Return the orbit, and its phase at a place of `nearest`."""

    @abstractmethod
    def through(self, point: Array, phase: int, *, leaving: bool) -> Self:
        """Return the orbit so shifted in time, if it may be, that a path through a point (2n,) keeps in step with it.

        That is a path that leaves it, or else one that approaches it; the point belongs to the phase.
        """

    @abstractmethod
    def again(self, propagator: SegmentPropagator) -> LinearizedOrbit:
        """Return the orbit found with another propagator, in another scene perhaps; may raise StructureError."""

    @abstractmethod
    def displacement(self, phase: int, momentum: Array) -> OrbitDisplacement:
        """Return how p·q, q the orbit at a phase, changes with the scene."""

    def closest(self, states: Array, begin: int = 0) -> tuple[float, int, float]:
        """Return the least distance of states (count, n) a piece apart, the first on the section, from `begin` on.

        It comes with the number of that state, and where on the orbit it is measured, for `starting`.
        """
        numbers = np.arange(begin, len(states))
        distances, places = self.nearest(states[begin:], numbers)
        nearest = int(np.argmin(distances))
        return float(distances[nearest]), int(numbers[nearest]), float(places[nearest])

    def point(self, phase: int) -> Array:
        """Return the orbit as (q, p)."""
        (state,) = self.along(phase, 1)
        return np.concatenate([state, np.zeros(len(state))])

    def conditions(self, phase: int, scale: Array, *, leaving: bool) -> Array:
        """Return what (n, 2n) is 0 of an offset over `scale` in the unstable space, or in the stable one."""
        return normals_of(self.space_at(phase, leaving=leaving), scale)

    def misfit(self, point: Array, phase: int, scale: Array, *, leaving: bool) -> Array:
        """Return how far a point (2n,) misses the unstable space at a phase, or the stable one, relative to `scale`."""
        return self.conditions(phase, scale, leaving=leaving) @ ((point - self.point(phase)) / scale)

    def misfit_derivatives(self, point: Array, phase: int, scale: Array, *, leaving: bool) -> Array:
        """Return the derivatives (n, 2n) of the misfit in the point over `scale`."""
        return self.conditions(phase, scale, leaving=leaving)

    def carried(self, phase: int, *, leaving: bool) -> Array:
        """Return how the piece that begins at a phase carries offsets (n, n), in the bases of their space."""
        before, after = self.space_at(phase, leaving=leaving), self.space_at(phase + 1, leaving=leaving)
        return _shares(after, self.step(phase) @ before)

    def offsets(self, point: Array, phase: int, sign: int) -> Iterator[Array]:
        """Yield offsets (2n,) from the orbit at the nodes that follow on a point (2n,), by the linearized equations.

        The point is in the stable space to go on after it (sign 1), in the unstable space to go back (sign −1).
        """
        leaving = sign < 0
        shares = _shares(self.space_at(phase, leaving=leaving), point - self.point(phase))
        while True:
            shares[: self.neutral] = 0.0  # what is not in the space would not decay
            carried = self.carried(min(phase, phase + sign), leaving=leaving)
            shares = np.asarray(np.linalg.solve(carried, shares)) if leaving else carried @ shares
            shares[np.abs(shares) < 1e-100] = 0.0  # the squares of smaller ones could underflow
            phase += sign
            yield self.space_at(phase, leaving=leaving) @ shares

    def continued(self, point: Array, phase: int, count: int) -> Array:
        """Return (q, p) at `count` nodes that continue a path after a point (2n,), or before it if negative."""
        sign = 1 if count > 0 else -1
        offsets = list(itertools.islice(self.offsets(point, phase, sign), abs(count)))[::sign]
        nodes = np.array(offsets).reshape(abs(count), len(point))
        nodes[:, : len(point) // 2] += self.along(phase + min(count, 1), abs(count))
        return nodes

    def missing(self, points: Array, phase: int, sign: int, radius: float, grain: int) -> int:
        """Return how many nodes to add for a path to start or end within a radius in (x, v); negative: to drop.

        The points (nodes, 2n) run from that end of the path, the start (sign −1) or the end (1); the phase is that of
        the first of them. Nodes are added or dropped `grain` at once. Raises StructureError if the linearized motion
        does not come within the radius in five times the time of its slowest rate: transient growth and spirals take
        longer than that time.
        """
        last = phase - sign * (len(points) - 1)
        orbit = self.along(min(phase, last), len(points))[::-sign][::grain]
        outside = np.linalg.norm(points[::grain, :2] - orbit[:, :2], axis=1) > radius
        if not outside[0]:
            return -grain * (int(np.argmax(outside)) - 1)
        distance = float(np.linalg.norm(points[0, :2] - orbit[0, :2]))
        most = 5.0 * (math.log(distance / radius) / self.slowest_rate + self.period_nodes)
        offsets = itertools.islice(self.offsets(points[0], phase, sign), grain - 1, None, grain)
        for added, offset in zip(itertools.count(grain, grain), offsets, strict=False):
            if np.linalg.norm(offset[:2]) <= radius:
                return added
            if added > most:
                break
        raise StructureError(
            f"the path does not approach its orbit: after {added} nodes more it is still farther than {radius:.1e} "
            "away."
        )


def _shares(basis: Array, vectors: Array) -> Array:
    """Return the coordinates (k,) or (k, count) in a basis (2n, k), whose columns may differ much in size."""
    sizes = np.linalg.norm(basis, axis=0)
    shares: Array = (np.linalg.lstsq(basis / sizes, vectors)[0].T / sizes).T
    return shares


def adjoint_weights(steps: Array, momentum: Array, rate: Array | None = None) -> Array:
    """Return the derivatives (pieces, n) of p·q, q the start of a closed orbit, in the images of its pieces.

    The orbit moves by δ at each node, δ′ = M δ + g with the change g of the image, and closes after its period. A limit
    cycle, whose rate at its start is given, closes after another duration: δ = M δ + g + b dT. There p·b = 0, so
    that the phase does not matter.

    Parameters
    ----------
    steps : array (pieces, n, n)
        The derivatives M of the pieces, from the start on.
    momentum : array (n,)
        p.
    rate : array (n,), optional
        b.
    """
    whole = np.eye(len(momentum))
    for step in steps:
        whole = step @ whole
    matrix, values = (np.eye(len(momentum)) - whole).T, momentum
    if rate is not None:
        unit = rate / np.linalg.norm(rate)
        matrix, values = np.vstack([matrix, unit]), np.append(momentum - unit * (unit @ momentum), 0.0)
    weight = np.linalg.lstsq(matrix, values)[0]
    weights = np.empty((len(steps), len(momentum)))
    for number in range(len(steps) - 1, -1, -1):
        weights[number] = weight
        weight = steps[number].T @ weight
    return weights
