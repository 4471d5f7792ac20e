"""LinearizedOrbit: an orbit of the noise-free motion, with Hamilton's equations linearized along it."""

from __future__ import annotations

import dataclasses
import math
from abc import ABC, abstractmethod
from typing import ClassVar, Self

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.polishing.orbit_displacement import OrbitDisplacement, pulls
from vibrokit.errors import StructureError
from vibrokit.structure.linear_map import GaussianMap, gaussian_pieces
from vibrokit.structure.orbits import refine_orbit

NEUTRAL = 1e-6
"""Distance of a multiplier's size from 1 below which its rate is lost in the orbit's own error."""
_PATIENCE = 5.0  # times the time in which the slowest motion decays: transient growth and spirals take longer

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class LinearizedOrbit(ABC):
    """A hyperbolic orbit at p = 0, and the linear spaces in which extremal paths leave and approach it. Abstract.

    Over a time the linearized equations are E = [[M, C M⁻ᵀ], [0, M⁻ᵀ]]. Both spaces have n of the 2n dimensions. Phases
    are whole numbers of pieces.
    """

    neutral: ClassVar[int] = 0  # number of neutral vectors in both spaces, the first ones of their bases

    propagator: SegmentPropagator
    multipliers: NDArray[np.complex128]  # (n,), of a period

    @property
    @abstractmethod
    def period_nodes(self) -> int:
        """Nodes in a period, rounded up."""

    @property
    @abstractmethod
    def slowest_rate(self) -> float:
        """Slowest rate, per piece, at which paths leave or approach."""

    @property
    def start_on_orbit(self) -> bool:
        """Whether paths start on the orbit itself, at p ≠ 0, instead of in the unstable space."""
        return False

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
    def unstable_at(self, phase: int) -> Array:
        """Return a basis (2n, n) of the unstable space of (δq, p)."""

    @abstractmethod
    def stable_at(self, phase: int) -> Array:
        """Return a basis (2n, n) of the stable space."""

    @abstractmethod
    def step(self, phase: int) -> Array:
        """Return E over the piece that begins at a phase."""

    @abstractmethod
    def nearest(self, states: Array) -> tuple[Array, Array]:
        """Return the distance of each state (count, n) of the section, and where it is measured, for `starting`."""

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

    def point(self, phase: int) -> Array:
        """Return the orbit as (q, p)."""
        (state,) = self.along(phase, 1)
        return np.concatenate([state, np.zeros(len(state))])

    def conditions(self, phase: int, scale: Array, *, leaving: bool) -> Array:
        """Return what (n, 2n) is 0 of an offset over `scale` in the unstable space, or in the stable one."""
        return normals_of(self.unstable_at(phase) if leaving else self.stable_at(phase), scale)

    def misfit(self, point: Array, phase: int, scale: Array, *, leaving: bool) -> Array:
        """Return how far a point (2n,) misses the unstable space at a phase, or the stable one, relative to `scale`."""
        return self.conditions(phase, scale, leaving=leaving) @ ((point - self.point(phase)) / scale)

    def misfit_derivatives(self, point: Array, phase: int, scale: Array, *, leaving: bool) -> Array:
        """Return the derivatives (n, 2n) of the misfit in the point over `scale`."""
        return self.conditions(phase, scale, leaving=leaving)

    def continued(self, point: Array, phase: int, count: int) -> Array:
        """Return (q, p) at `count` nodes that continue a path after a point, or before it if negative.

        The point (2n,) is in the stable space to continue after it, in the unstable space to continue before it.
        """
        sign = 1 if count > 0 else -1
        offset, nodes = point - self.point(phase), []
        for number in range(1, abs(count) + 1):
            there = phase + sign * number
            if sign > 0:
                basis, image = self.stable_at(there), self.step(there - 1) @ offset
                shares = np.linalg.lstsq(basis, image)[0]
            else:
                basis = self.unstable_at(there)
                ahead = self.step(there) @ basis
                sizes = np.linalg.norm(ahead, axis=0)
                shares = np.linalg.lstsq(ahead / sizes, offset)[0] / sizes
            shares[: self.neutral] = 0.0  # what is not in the space would not decay
            offset = basis @ shares
            nodes.append(self.point(there) + offset)
        return np.array(nodes[::sign]).reshape(abs(count), len(point))

    def missing(self, points: Array, phase: int, sign: int, radius: float, grain: int) -> int:
        """Return how many nodes to add for a path to start or end within a radius in (x, v); negative: to drop.

        The points (nodes, 2n) run from that end of the path, the start (sign −1) or the end (1); the phase is that of
        the first of them. Nodes are added or dropped `grain` at once. Raises StructureError if the linearized motion
        does not come within the radius in several times the time that its slowest rate takes.
        """
        last = phase - sign * (len(points) - 1)
        orbit = self.along(min(phase, last), len(points))[::-sign][::grain]
        outside = np.linalg.norm(points[::grain, :2] - orbit[:, :2], axis=1) > radius
        if not outside[0]:
            return -grain * (int(np.argmax(outside)) - 1)
        added, point = 0, points[0]
        distance = float(np.linalg.norm((point - self.point(phase))[:2]))
        most = _PATIENCE * (math.log(distance / radius) / self.slowest_rate + self.period_nodes)
        while np.linalg.norm((point - self.point(phase + sign * added))[:2]) > radius:
            if added > most:
                raise StructureError(
                    f"the path does not approach its orbit: after {added} nodes more it is still farther than "
                    f"{radius:.1e} away."
                )
            nodes = self.continued(point, phase + sign * added, sign * grain)
            point = nodes[-1] if sign > 0 else nodes[0]
            added += grain
        return added


@dataclasses.dataclass(frozen=True, eq=False)
class LinearizedAtNodes(LinearizedOrbit):
    """A periodic orbit or an equilibrium: it repeats after a whole number of pieces."""

    states: Array  # (nodes, n): the orbit at each node, from the section on
    linear: GaussianMap  # M and C of the pieces that begin at the nodes
    unstable: Array  # (nodes, 2n, n)
    stable: Array  # (nodes, 2n, n)
    left_from_itself: bool = False

    @property
    def period_nodes(self) -> int:
        return len(self.states)

    @property
    def slowest_rate(self) -> float:
        return float(np.abs(np.log(np.abs(self.multipliers))).min()) / len(self.states)

    @property
    def start_on_orbit(self) -> bool:
        return self.left_from_itself

    def with_start_on_orbit(self) -> Self:
        size = self.states.shape[1]
        free = np.vstack([np.zeros((size, size)), np.eye(size)])
        return dataclasses.replace(self, unstable=np.broadcast_to(free, self.unstable.shape), left_from_itself=True)

    def node(self, phase: int) -> int:
        return phase % len(self.states)

    def along(self, first: int, count: int) -> Array:
        return self.states[(first + np.arange(count)) % len(self.states)]

    def unstable_at(self, phase: int) -> Array:
        return self.unstable[self.node(phase)]

    def stable_at(self, phase: int) -> Array:
        return self.stable[self.node(phase)]

    def step(self, phase: int) -> Array:
        return extended(self.linear.derivatives[self.node(phase)], self.linear.covariances[self.node(phase)])

    def nearest(self, states: Array) -> tuple[Array, Array]:
        phases = np.arange(0, len(self.states), self.propagator.pieces)
        distances = np.linalg.norm((states[:, None] - self.states[phases]) / self.propagator.units, axis=2)
        distances = np.where(np.isfinite(distances), distances, np.inf)
        return distances.min(axis=1), phases[np.argmin(distances, axis=1)]

    def starting(self, place: float) -> tuple[Self, int]:
        return self, int(place)

    def through(self, point: Array, phase: int, *, leaving: bool) -> Self:
        return self

    def again(self, propagator: SegmentPropagator) -> LinearizedAtNodes:
        found = orbit_at_nodes(propagator, self.states[0], len(self.states) // propagator.pieces)
        return found.with_start_on_orbit() if self.left_from_itself else found

    def displacement(self, phase: int, momentum: Array) -> OrbitDisplacement:
        phases = (phase + np.arange(len(self.states))) % len(self.states)
        weights = pulls(self.linear.derivatives[phases], momentum)
        return OrbitDisplacement(self.states[phases], np.roll(self.states, -1, axis=0)[phases], weights, phases, None)


def orbit_at_nodes(propagator: SegmentPropagator, point: Array, period: int) -> LinearizedAtNodes:
    """Linearize Hamilton's equations along an orbit of any stability that repeats after some section intervals.

    From the section, the spaces are carried to the other nodes, the unstable one forward and the stable one backward:
    in these directions they attract.

    The point (n,) on the section is refined. Raises StructureError if there is no orbit, or if it is not hyperbolic.
    """
    orbit = refine_orbit(propagator.osc, point, period, propagator.stepper)
    nodes = period * propagator.pieces
    states, linear = gaussian_pieces(propagator.osc, orbit.point, propagator.stepper, propagator.pieces, nodes)
    monodromy, covariance = linear.composed()
    multipliers = np.linalg.eigvals(monodromy).astype(complex)
    check_hyperbolic(orbit.point, multipliers)
    spaces = invariant_spaces(monodromy, covariance, np.empty((len(point), 0)))
    unstable, stable = carried_along(linear, *spaces, scale_of(propagator, covariance))
    return LinearizedAtNodes(propagator, multipliers, states[:-1], linear, unstable, stable)


def check_hyperbolic(point: Array, multipliers: NDArray[np.complex128]) -> None:
    """Raise StructureError if a multiplier has the size 1."""
    nearest = multipliers[np.argmin(np.abs(np.abs(multipliers) - 1))]
    if not abs(abs(nearest) - 1) > NEUTRAL:
        raise StructureError(
            f"the orbit at {tuple(point.tolist())} is not hyperbolic: it has the multiplier {nearest:.8g}, of "
            "size 1, so no path leaves or approaches it exponentially; move a parameter away from the bifurcation."
        )


def carried_along(
    linear: GaussianMap, unstable: Array, stable: Array, scale: Array, neutral: int = 0
) -> tuple[Array, Array]:
    """Return the spaces at all nodes, given at the first: the unstable one carried forward, the stable one backward.

    The first vectors of both, which are neutral, stay what they are.
    """
    steps = [extended(step, part) for step, part in zip(linear.derivatives, linear.covariances, strict=True)]
    forward, backward = [normalized(unstable, scale, neutral)], [normalized(stable, scale, neutral)]
    for node in range(len(steps) - 1):
        forward.append(normalized(steps[node] @ forward[-1], scale, neutral))
        before = np.asarray(np.linalg.solve(steps[-1 - node], backward[-1]), dtype=float)
        backward.append(normalized(before, scale, neutral))
    return np.array(forward), np.array([backward[0], *backward[:0:-1]])


def normals_of(basis: Array, scale: Array) -> Array:
    """Return an orthonormal basis (n, 2n), in units of `scale`, of the complement of a space."""
    full = np.linalg.qr(basis / scale[:, None], mode="complete")[0]
    return full[:, basis.shape[1] :].T


def extended(step: Array, covariance: Array) -> Array:
    """E = [[M, C M⁻ᵀ], [0, M⁻ᵀ]]."""
    inverse = np.linalg.inv(step).T
    return np.block([[step, covariance @ inverse], [np.zeros_like(step), inverse]])


def invariant_spaces(monodromy: Array, covariance: Array, neutral: Array) -> tuple[Array, Array]:
    """Bases (2n, n) of the unstable and the stable space of the extended map.

    With the map's invariant spaces M V = V A and their dual bases Lᵀ (s stable, u unstable), the unstable space of the
    extended map is spanned by (V_u, 0) and (V_s y, L_s), y = A_s y A_sᵀ + L_sᵀ C L_s; for an attractor that is
    (Σ, 1). The stable space is spanned by (V_s, 0) and (V_u y, L_u) with the same equation for u. Both have the
    directions (V_0, 0) besides, in which paths are shifted in time: `neutral`, array (n, count).
    """
    _, stable, decaying = scipy.linalg.schur(monodromy / (1 - NEUTRAL / 2), sort="iuc")
    _, unstable, growing = scipy.linalg.schur(monodromy / (1 + NEUTRAL / 2), sort="ouc")
    vectors = np.hstack([stable[:, :decaying], unstable[:, :growing], neutral])
    duals = np.linalg.inv(vectors).T
    strict = slice(decaying, decaying + growing)
    v_s, v_u, l_s, l_u = vectors[:, :decaying], vectors[:, strict], duals[:, :decaying], duals[:, strict]
    y_s, y_u = np.zeros((decaying, decaying)), np.zeros((growing, growing))
    if decaying:
        y_s = scipy.linalg.solve_discrete_lyapunov(l_s.T @ monodromy @ v_s, l_s.T @ covariance @ l_s)
    if growing:
        back = np.linalg.inv(l_u.T @ monodromy @ v_u)
        y_u = scipy.linalg.solve_discrete_lyapunov(back, -back @ l_u.T @ covariance @ l_u @ back.T)
    still = np.hstack([neutral, v_u])
    leaving = np.hstack([np.vstack([still, np.zeros_like(still)]), np.vstack([v_s @ y_s, l_s])])
    still = np.hstack([neutral, v_s])
    approaching = np.hstack([np.vstack([still, np.zeros_like(still)]), np.vstack([v_u @ y_u, l_u])])
    return leaving, approaching


def scale_of(propagator: SegmentPropagator, covariance: Array) -> Array:
    """Sizes of (q, p) that belong together, for well-conditioned bases."""
    size = propagator.units
    gathered = np.maximum(np.diag(covariance) / size, np.finfo(float).tiny)
    return np.concatenate([size, 1 / np.maximum(gathered, 1e-12 * gathered.max())])


def normalized(basis: Array, scale: Array, neutral: int) -> Array:
    """Return a basis of the same space, in units of `scale`: its first vectors as they are, the others orthonormal."""
    still, others = np.hsplit(basis / scale[:, None], [neutral])
    still = still / np.linalg.norm(still, axis=0)
    return np.asarray(scale[:, None] * np.hstack([still, np.linalg.qr(others)[0]]), dtype=np.float64)
