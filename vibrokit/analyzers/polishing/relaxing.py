"""Relaxing: a path brought down to a local minimum of its action, the pieces priced by Hamilton's equations."""

from __future__ import annotations

import dataclasses

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from vibrokit.analyzers.polishing.carrier import Carrier, Extremal
from vibrokit.analyzers.polishing.endings import Ending

_ITERATIONS = 100
_INNER = 8
_MATCHED = 1e-5  # of the extent of the path: how well a piece meets its end; what is missed is priced to first order
_CONVERGED = 1e-9  # of the action: what an iteration still promises
_FIRST_DAMPING, _LEAST_DAMPING, _MOST_DAMPING = 1e-2, 1e-8, 1e6

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class _Look:
    """A path of given nodes: extremal pieces between them."""

    states: Array
    momenta: Array
    carried: Extremal
    action: float


class _Relaxer:
    """Newton's method on the action as a function of the states at the nodes, damped until it descends."""

    def __init__(
        self, carrier: Carrier, first: int, target: Array, closing: Array | None, last: float | None = None
    ) -> None:
        n = carrier.size
        self.carrier, self.first, self.last, self.n = carrier, first, last, n
        self.target = target
        self.pinned = closing is None
        self.closing = np.zeros((n, n)) if closing is None else closing

    def look(self, states: Array, momenta: Array) -> _Look | None:
        """Find the momenta that lead from node to node; None where there are none near those given."""
        extent = np.ptp(states, axis=0)
        for _ in range(_INNER):
            carried = self.carrier.extremal(np.hstack([states[:-1], momenta]), self.first, self.last)
            misses = states[1:] - carried.images[:, : self.n]
            if not np.isfinite(carried.slopes).all():
                return None
            if np.all(np.abs(misses) <= _MATCHED * extent):
                tail = states[-1] - self.target
                after = 0.5 * float(tail @ self.closing @ tail)
                missed = float(np.sum(carried.images[:, self.n :] * misses))
                return _Look(states, momenta, carried, float(np.sum(carried.actions)) + missed + after)
            momenta = momenta + np.linalg.solve(carried.slopes[:, : self.n, self.n :], misses[..., None])[..., 0]
        return None

    def moved(self, look: _Look, step: Array) -> _Look | None:
        """Look at the path whose nodes are moved, with momenta moved as they would be by a small step."""
        n, slopes = self.n, look.carried.slopes
        ahead = step[1:] - np.einsum("kij,kj->ki", slopes[:, :n, :n], step[:-1])
        lifted = look.momenta + np.linalg.solve(slopes[:, :n, n:], ahead[..., None])[..., 0]
        return self.look(look.states + step, lifted)

    def gradient(self, look: _Look) -> Array:
        """∂S/∂q at each node: the momentum that comes in less the one that goes out; 0 where the state is held."""
        outgoing = np.vstack([look.momenta, -(self.closing @ (look.states[-1] - self.target))])
        slope = -outgoing
        slope[1:] += look.carried.images[:, self.n :]
        slope[0] = 0.0
        if self.pinned:
            slope[-1] = 0.0
        return slope

    def curvature(self, look: _Look) -> tuple[Array, Array]:
        """Second derivatives: the blocks on the diagonal, and those below it."""
        n, slopes = self.n, look.carried.slopes
        turn = np.linalg.inv(slopes[:, :n, n:])  # ∂p/∂q of a start, in the state that is led to
        here = turn @ slopes[:, :n, :n]
        below = slopes[:, n:, :n] - slopes[:, n:, n:] @ here
        diagonal = np.concatenate([here, self.closing[None]])
        diagonal[1:] += slopes[:, n:, n:] @ turn
        below = (below - turn.transpose(0, 2, 1)) / 2
        below[0] = 0.0
        if self.pinned:
            below[-1] = 0.0
        return (diagonal + diagonal.transpose(0, 2, 1)) / 2, below

    def relax(self, states: Array, momenta: Array) -> _Look | None:
        """Descend until little is left to be gained; None where the guess cannot be priced."""
        look = self.look(states, momenta)
        damping = _FIRST_DAMPING
        for _ in range(_ITERATIONS if look is not None else 0):
            assert look is not None
            slope, (diagonal, below) = self.gradient(look), self.curvature(look)
            before = look.action
            while damping < _MOST_DAMPING:
                step = _step(diagonal, below, slope, damping)
                new = None if step is None else self.moved(look, step)
                promised = 0.0 if step is None else -float(np.sum(slope * step)) / 2
                if step is not None and promised < _CONVERGED * before:
                    return look
                gain = -1.0 if new is None else (before - new.action) / promised
                if gain < 0.25:
                    damping *= 4
                elif gain > 0.75:
                    damping = max(damping / 6, _LEAST_DAMPING)
                if new is not None and gain > 0:
                    look = new
                    break
            else:
                break
        return look


def relaxed(carrier: Carrier, first: int, ending: Ending, points: Array, last: float | None = None) -> Array:
    """Bring a path down to a local minimum of the action, with its pieces extremal and its first state held.

    The action of a piece as a function of the states at its two nodes has the momenta for its derivatives, and blocks
    of the variational equations for its second ones: Newton's method for the least sum has a banded matrix, and where
    a step would not descend it is damped. It comes to the solution of `extremal_path` from farther away, and to minima
    only.

    Parameters
    ----------
    carrier : Carrier
    first : int
        Phase of the first node, in pieces since the section.
    ending : Ending
    points : array (nodes, 2n)
        Guess of (q, p).
    last : float, optional
        Length of the last piece (s), if it is not one like the others.

    Returns
    -------
    array (nodes, 2n)
        The guess itself where it cannot be priced.
    """
    n = carrier.size
    relaxer = _Relaxer(carrier, first, *ending.closing(n), last)
    look = relaxer.relax(points[:, :n], points[:-1, n:])
    if look is None:
        return points
    return np.hstack([look.states, np.vstack([look.momenta, look.carried.images[-1:, n:]])])


def relaxed_between(carrier: Carrier, first: int, points: Array) -> tuple[Array, float]:
    """Bring a path down to a local minimum of the action, with its first and its last state held.

    Parameters
    ----------
    carrier : Carrier
    first : int
        Phase of the first node, in pieces since the section.
    points : array (nodes, 2n)
        The states, and guesses of the momenta.

    Returns
    -------
    states : array (nodes, n)
    action : float
        NaN where the guess cannot be priced.
    """
    n = carrier.size
    look = _Relaxer(carrier, first, np.zeros(n), None).relax(points[:, :n], points[:-1, n:])
    return (points[:, :n], float("nan")) if look is None else (look.states, look.action)


def _step(diagonal: Array, below: Array, slope: Array, damping: float) -> Array | None:
    """Newton step with a share of the diagonal's size added to it; None where it would be no descent."""
    count, n = slope.shape
    values, vectors = np.linalg.eigh(diagonal)
    raised = diagonal + damping * np.einsum("kij,kj,klj->kil", vectors, np.abs(values), vectors)
    bands = np.zeros((2 * n, count * n))
    for i in range(n):
        for j in range(i + 1):
            bands[i - j, j::n] = raised[:, i, j]
        for j in range(n):
            bands[n + i - j, j : -n or None : n] = below[:, i, j]
    try:
        solved = scipy.linalg.solveh_banded(bands, -slope.ravel(), lower=True)
    except np.linalg.LinAlgError:
        return None
    return solved.reshape(count, n) if np.isfinite(solved).all() else None
