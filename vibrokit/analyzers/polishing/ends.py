"""Ends of exit paths: orbits of the motion without noise, with Hamilton's equations linearised along them."""

from __future__ import annotations

import dataclasses

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from vibrokit.analyzers.polishing.carrier import Carrier, Linear
from vibrokit.errors import StructureError
from vibrokit.structure.orbits import refine_orbit

_NEUTRAL = 1e-6

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class End:
    """A hyperbolic orbit at p = 0, and the linear spaces in which paths leave it and come to it.

    Over a time the linearised equations are E = [[M, C M⁻ᵀ], [0, M⁻ᵀ]]. Both spaces have n of the 2n dimensions.

    Attributes
    ----------
    states : array (nodes, n)
        The orbit at each node, from the section on.
    linear : Linear
        M and C of the pieces that begin at the nodes.
    leaving, coming : array (nodes, 2n, n)
        Bases of the unstable and of the stable space of (δq, p).
    multipliers : complex array (n,)
        Of the orbit.
    pieces : int
        Nodes in a section interval.
    held : bool
        Whether paths start on the orbit itself, at p ≠ 0, after a finite time.
    """

    states: Array
    linear: Linear
    leaving: Array
    coming: Array
    multipliers: NDArray[np.complex128]
    pieces: int
    held: bool = False

    def on_orbit(self) -> End:
        """The same orbit, left by paths that start on it: for one that motion is linear round no farther than rounding.

        Such a path takes a finite time, so that it costs more than the least action, the less the longer it is.
        """
        size = self.states.shape[1]
        free = np.vstack([np.zeros((size, size)), np.eye(size)])
        return dataclasses.replace(self, leaving=np.broadcast_to(free, self.leaving.shape), held=True)

    def node(self, phase: int) -> int:
        """Number of the node at which a path is that has so many pieces to go from point 0 of the orbit."""
        return phase % len(self.states)

    def point(self, phase: int) -> Array:
        """The orbit as (q, p)."""
        return np.concatenate([self.states[self.node(phase)], np.zeros(self.states.shape[1])])

    def before(self, point: Array, phase: int, count: int) -> Array:
        """Return (q, p) at `count` nodes before a point that lies in the unstable space, the earliest first."""
        offset, nodes = point - self.point(phase), []
        for number in range(1, count + 1):
            node = self.node(phase - number)
            ahead = self._step(node) @ self.leaving[node]
            sizes = np.linalg.norm(ahead, axis=0)
            shares = np.linalg.lstsq(ahead / sizes, offset)[0] / sizes
            offset = self.leaving[node] @ shares
            nodes.append(self.point(node) + offset)
        return np.array(nodes[::-1]).reshape(count, len(point))

    def after(self, point: Array, phase: int, count: int) -> Array:
        """Return (q, p) at `count` nodes after a point that lies in the stable space."""
        offset, nodes = point - self.point(phase), []
        for number in range(1, count + 1):
            node = self.node(phase + number)
            basis = self.coming[node]
            offset = basis @ np.linalg.lstsq(basis, self._step(node - 1) @ offset)[0]
            nodes.append(self.point(node) + offset)
        return np.array(nodes).reshape(count, len(point))

    def rate(self) -> float:
        """Slowest rate, per piece, at which paths leave or come."""
        return float(np.abs(np.log(np.abs(self.multipliers))).min()) / len(self.states)

    def _step(self, node: int) -> Array:
        return extended(self.linear.steps[node], self.linear.gramians[node])


def extended(step: Array, gramian: Array) -> Array:
    """Return E = [[M, C M⁻ᵀ], [0, M⁻ᵀ]]."""
    inverse = np.linalg.inv(step).T
    return np.block([[step, gramian @ inverse], [np.zeros_like(step), inverse]])


def linear_end(carrier: Carrier, point: Array, period: int) -> End:
    """Linearise Hamilton's equations along an orbit of any stability.

    With the map's invariant spaces M V = V A and their dual bases Lᵀ (s stable, u unstable), the unstable space of the
    extended map is spanned by (V_u, 0) and (V_s y, L_s), y = A_s y A_sᵀ + L_sᵀ C L_s; for an attractor that is
    (Σ, 1). The stable space is spanned by (V_s, 0) and (V_u y, L_u) with the same equation of u. From the section they
    are carried to the other nodes, the one forwards and the other backwards, in which direction each is attracting.

    Parameters
    ----------
    carrier : Carrier
    point : array (n,)
        A point of the orbit on the section; it is refined.
    period : int
        In section intervals.

    Raises
    ------
    StructureError
        There is no orbit, or it is not hyperbolic: a multiplier has size 1.
    """
    orbit = refine_orbit(carrier.osc, point, period, carrier.stepper)
    nodes = period * carrier.pieces
    states, parts = [orbit.point], []
    for node in range(nodes):
        parts.append(carrier.linear(states[-1][None], node))
        states.append(parts[-1].images[0])
    linear = Linear(*(np.concatenate([getattr(part, field.name) for part in parts])
                      for field in dataclasses.fields(Linear)))  # fmt: skip
    monodromy, gramian = _over_all(linear)
    multipliers = np.linalg.eigvals(monodromy).astype(complex)
    nearest = multipliers[np.argmin(np.abs(np.abs(multipliers) - 1))]
    if not abs(abs(nearest) - 1) > _NEUTRAL:
        raise StructureError(
            f"the orbit at {tuple(orbit.point.tolist())} has the multiplier {nearest:.8g}, of size 1: it is not "
            "hyperbolic, and no path leaves it or comes to it at a rate; move a parameter off the bifurcation."
        )
    leaving, coming = _spaces(monodromy, gramian)
    scale: Array = np.asarray(_scale(carrier, gramian), dtype=np.float64)
    steps = [extended(step, part) for step, part in zip(linear.steps, linear.gramians, strict=True)]
    unstable: list[Array] = [_orthonormal(leaving, scale)]
    stable: list[Array] = [_orthonormal(coming, scale)]
    for node in range(nodes - 1):
        unstable.append(_orthonormal(steps[node] @ unstable[-1], scale))
        stable.append(_orthonormal(np.asarray(np.linalg.solve(steps[-1 - node], stable[-1]), dtype=np.float64), scale))
    stable = [stable[0], *stable[:0:-1]]
    return End(np.array(states[:-1]), linear, np.array(unstable), np.array(stable), multipliers, carrier.pieces)


def _over_all(linear: Linear) -> tuple[Array, Array]:
    """M and C of all pieces together: put together, for M⁻ᵀ grows and would bury C in rounding errors."""
    size = linear.steps.shape[1]
    monodromy, gramian = np.eye(size), np.zeros((size, size))
    for step, part in zip(linear.steps, linear.gramians, strict=True):
        monodromy, gramian = step @ monodromy, step @ gramian @ step.T + part
    return monodromy, gramian


def _spaces(monodromy: Array, gramian: Array) -> tuple[Array, Array]:
    """Bases (2n, n) of the unstable and the stable space of the extended map."""
    size = len(monodromy)
    _, stable, decaying = scipy.linalg.schur(monodromy, sort="iuc")
    _, unstable, growing = scipy.linalg.schur(monodromy, sort="ouc")
    vectors = np.hstack([stable[:, :decaying], unstable[:, :growing]])
    duals = np.linalg.inv(vectors).T
    v_s, v_u, l_s, l_u = vectors[:, :decaying], vectors[:, decaying:], duals[:, :decaying], duals[:, decaying:]
    y_s, y_u = np.zeros((decaying, decaying)), np.zeros((growing, growing))
    if decaying:
        y_s = scipy.linalg.solve_discrete_lyapunov(l_s.T @ monodromy @ v_s, l_s.T @ gramian @ l_s)
    if growing:
        back = np.linalg.inv(l_u.T @ monodromy @ v_u)
        y_u = scipy.linalg.solve_discrete_lyapunov(back, -back @ l_u.T @ gramian @ l_u @ back.T)
    leaving = np.hstack([np.vstack([v_u, np.zeros((size, growing))]), np.vstack([v_s @ y_s, l_s])])
    coming = np.hstack([np.vstack([v_s, np.zeros((size, decaying))]), np.vstack([v_u @ y_u, l_u])])
    return leaving, coming


def _scale(carrier: Carrier, gramian: Array) -> Array:
    """Sizes of (q, p) that belong together, for well-conditioned bases."""
    size = np.ones(carrier.size)
    size[1] = carrier.osc.natural_frequency
    gathered = np.maximum(np.diag(gramian) / size, np.finfo(float).tiny)
    return np.asarray(np.concatenate([size, 1 / np.maximum(gathered, 1e-12 * gathered.max())]), dtype=np.float64)


def _orthonormal(basis: Array, scale: Array) -> Array:
    return scale[:, None] * np.linalg.qr(basis / scale[:, None])[0]
