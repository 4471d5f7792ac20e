"""LinearizedOrbit: an orbit of the noise-free motion, with Hamilton's equations linearized along it."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.errors import StructureError
from vibrokit.structure.linear_map import GaussianMap, gaussian_pieces
from vibrokit.structure.orbits import refine_orbit

_PATIENCE = 5.0  # times the time in which the slowest motion decays: transient growth and spirals take longer
_NEUTRAL = 1e-6  # distance of a multiplier's size from 1 below which its rate is lost in the orbit's own error

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class LinearizedOrbit:
    """A hyperbolic orbit at p = 0, and the linear spaces in which extremal paths leave and approach it.

    Over a time the linearized equations are E = [[M, C M⁻ᵀ], [0, M⁻ᵀ]]. Both spaces have n of the 2n dimensions.
    """

    states: Array  # (nodes, n): the orbit at each node, from the section on
    linear: GaussianMap  # M and C of the pieces that begin at the nodes
    unstable: Array  # (nodes, 2n, n): bases of the unstable space of (δq, p)
    stable: Array  # (nodes, 2n, n): bases of the stable space
    multipliers: NDArray[np.complex128]  # (n,)
    start_on_orbit: bool = False  # whether paths start on the orbit itself, at p ≠ 0, instead of in the unstable space

    def with_start_on_orbit(self) -> LinearizedOrbit:
        """Return the same orbit, left by paths that start on it.

        It serves orbits around which the linearized equations hold in too small a neighborhood. Such a path takes a
        finite time, so that it costs more than the least action; the longer it is, the less.
        """
        size = self.states.shape[1]
        free = np.vstack([np.zeros((size, size)), np.eye(size)])
        return dataclasses.replace(self, unstable=np.broadcast_to(free, self.unstable.shape), start_on_orbit=True)

    @property
    def slowest_rate(self) -> float:
        """Slowest rate, per piece, at which paths leave or approach."""
        return float(np.abs(np.log(np.abs(self.multipliers))).min()) / len(self.states)

    def node(self, phase: int) -> int:
        """Return the node at a phase, in pieces from node 0 of the orbit."""
        return phase % len(self.states)

    def point(self, phase: int) -> Array:
        """Return the orbit as (q, p)."""
        return np.concatenate([self.states[self.node(phase)], np.zeros(self.states.shape[1])])

    def along(self, first: int, count: int) -> Array:
        """Return the states (count, n) at consecutive phases."""
        return self.states[(first + np.arange(count)) % len(self.states)]

    def continued(self, point: Array, phase: int, count: int) -> Array:
        """Return (q, p) at `count` nodes that continue a path after a point, or before it if negative.

        The point (2n,) is in the stable space to continue after it, in the unstable space to continue before it.
        """
        sign = 1 if count > 0 else -1
        offset, nodes = point - self.point(phase), []
        for number in range(1, abs(count) + 1):
            node = self.node(phase + sign * number)
            if sign > 0:
                basis, image = self.stable[node], self._step(node - 1) @ offset
                offset = basis @ np.linalg.lstsq(basis, image)[0]
            else:
                ahead = self._step(node) @ self.unstable[node]
                sizes = np.linalg.norm(ahead, axis=0)
                offset = self.unstable[node] @ (np.linalg.lstsq(ahead / sizes, offset)[0] / sizes)
            nodes.append(self.point(node) + offset)
        return np.array(nodes[::sign]).reshape(abs(count), len(point))

    def missing(self, points: Array, phase: int, sign: int, radius: float, grain: int) -> int:
        """Return how many nodes to add for a path to start or end within a radius in (x, v); negative: to drop.

        The points (nodes, 2n) run from that end of the path, the start (sign −1) or the end (1); the phase is that of
        the first of them. Nodes are added or dropped `grain` at once. Raises StructureError if the linearized motion
        does not come within the radius in several times the time that its slowest rate takes.
        """
        orbit = self.states[(phase - sign * np.arange(0, len(points), grain)) % len(self.states)]
        outside = np.linalg.norm(points[::grain, :2] - orbit[:, :2], axis=1) > radius
        if not outside[0]:
            return -grain * (int(np.argmax(outside)) - 1)
        added, point = 0, points[0]
        distance = float(np.linalg.norm((point - self.point(phase))[:2]))
        most = _PATIENCE * (math.log(distance / radius) / self.slowest_rate + len(self.states))
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

    def _step(self, node: int) -> Array:
        return _extended(self.linear.derivatives[node], self.linear.covariances[node])


def linearized_orbit(propagator: SegmentPropagator, point: Array, period: int) -> LinearizedOrbit:
    """Linearize Hamilton's equations along an orbit of any stability.

    With the map's invariant spaces M V = V A and their dual bases Lᵀ (s stable, u unstable), the unstable space of the
    extended map is spanned by (V_u, 0) and (V_s y, L_s), y = A_s y A_sᵀ + L_sᵀ C L_s; for an attractor that is
    (Σ, 1). The stable space is spanned by (V_s, 0) and (V_u y, L_u) with the same equation for u. From the section they
    are carried to the other nodes, the one forward and the other backward: in these directions they attract.

    The point (n,) on the section is refined; the period is in section intervals. Raises StructureError if there is no
    orbit, or if it is not hyperbolic.
    """
    orbit = refine_orbit(propagator.osc, point, period, propagator.stepper)
    nodes = period * propagator.pieces
    states, linear = gaussian_pieces(propagator.osc, orbit.point, propagator.stepper, propagator.pieces, nodes)
    monodromy, covariance = linear.composed()
    multipliers = np.linalg.eigvals(monodromy).astype(complex)
    nearest = multipliers[np.argmin(np.abs(np.abs(multipliers) - 1))]
    if not abs(abs(nearest) - 1) > _NEUTRAL:
        raise StructureError(
            f"the orbit at {tuple(orbit.point.tolist())} is not hyperbolic: it has the multiplier {nearest:.8g}, of "
            "size 1, so no path leaves or approaches it exponentially; move a parameter away from the bifurcation."
        )
    unstable, stable = _spaces(monodromy, covariance)
    scale = _scale(propagator, covariance)
    steps = [_extended(step, part) for step, part in zip(linear.derivatives, linear.covariances, strict=True)]
    forward, backward = [_orthonormal(unstable, scale)], [_orthonormal(stable, scale)]
    for node in range(nodes - 1):
        forward.append(_orthonormal(steps[node] @ forward[-1], scale))
        backward.append(_orthonormal(np.asarray(np.linalg.solve(steps[-1 - node], backward[-1]), dtype=float), scale))
    backward = [backward[0], *backward[:0:-1]]
    return LinearizedOrbit(states[:-1], linear, np.array(forward), np.array(backward), multipliers)


def normals_of(basis: Array, scale: Array) -> Array:
    """Return an orthonormal basis (n, 2n), in units of `scale`, of the complement of a space."""
    full = np.linalg.qr(basis / scale[:, None], mode="complete")[0]
    return full[:, basis.shape[1] :].T


def _extended(step: Array, covariance: Array) -> Array:
    """E = [[M, C M⁻ᵀ], [0, M⁻ᵀ]]."""
    inverse = np.linalg.inv(step).T
    return np.block([[step, covariance @ inverse], [np.zeros_like(step), inverse]])


def _spaces(monodromy: Array, covariance: Array) -> tuple[Array, Array]:
    """Bases (2n, n) of the unstable and the stable space of the extended map."""
    size = len(monodromy)
    _, stable, decaying = scipy.linalg.schur(monodromy, sort="iuc")
    _, unstable, growing = scipy.linalg.schur(monodromy, sort="ouc")
    vectors = np.hstack([stable[:, :decaying], unstable[:, :growing]])
    duals = np.linalg.inv(vectors).T
    v_s, v_u, l_s, l_u = vectors[:, :decaying], vectors[:, decaying:], duals[:, :decaying], duals[:, decaying:]
    y_s, y_u = np.zeros((decaying, decaying)), np.zeros((growing, growing))
    if decaying:
        y_s = scipy.linalg.solve_discrete_lyapunov(l_s.T @ monodromy @ v_s, l_s.T @ covariance @ l_s)
    if growing:
        back = np.linalg.inv(l_u.T @ monodromy @ v_u)
        y_u = scipy.linalg.solve_discrete_lyapunov(back, -back @ l_u.T @ covariance @ l_u @ back.T)
    leaving = np.hstack([np.vstack([v_u, np.zeros((size, growing))]), np.vstack([v_s @ y_s, l_s])])
    approaching = np.hstack([np.vstack([v_s, np.zeros((size, decaying))]), np.vstack([v_u @ y_u, l_u])])
    return leaving, approaching


def _scale(propagator: SegmentPropagator, covariance: Array) -> Array:
    """Sizes of (q, p) that belong together, for well-conditioned bases."""
    size = propagator.units
    gathered = np.maximum(np.diag(covariance) / size, np.finfo(float).tiny)
    return np.concatenate([size, 1 / np.maximum(gathered, 1e-12 * gathered.max())])


def _orthonormal(basis: Array, scale: Array) -> Array:
    return np.asarray(scale[:, None] * np.linalg.qr(basis / scale[:, None])[0], dtype=np.float64)
