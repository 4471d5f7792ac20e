"""Action descent: Newton's method on the action as a function of the states at the nodes of a path."""

from __future__ import annotations

import dataclasses

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.progress import count
from vibrokit.structure.linear_map import HamiltonianMap

_ITERATIONS = 100  # generic paths need 5 to 30; those of a nearly degenerate family descend slowly
_INNER = 20  # Newton's method on the momenta of the segments; it converges in 2 to 4, beside contacts in up to 20
_MATCHED = 1e-5  # of the path's extent: accuracy with which a segment reaches its end; the rest is counted to 1st order
_CONVERGED = 1e-9  # of the action
# Pieces between a node and a short contact: a nearer node is left out, since its velocity would have to be reversed for
# the impact to move to its other side. Of 16 paths between fixed states, 13 were the same with 8, 16 and 32 pieces for
# 0.02, 0.1 and 0.25, and 12 for 0.5; from 0.25 on, their actions were 6 % less on average.
_BESIDE = 0.25
_FIRST_DAMPING, _LEAST_DAMPING, _MOST_DAMPING = 1e-2, 1e-8, 1e6

Array = NDArray[np.float64]
Closing = tuple[Array, Array]
"""A state x₀ (n,) and a form A (n, n): after the last node a path still costs ½ (x − x₀)ᵀA(x − x₀)."""


@dataclasses.dataclass(frozen=True, eq=False)
class _Evaluation:
    """A path through the states at some of its nodes, its segments extremal."""

    nodes: NDArray[np.intp]  # one or two pieces apart
    states: Array
    momenta: Array
    carried: HamiltonianMap
    between: Array  # (q, p) at the other nodes
    action: float

    @property
    def points(self) -> Array:
        """(q, p) at all nodes."""
        last = self.carried.images[-1:, self.states.shape[1] :]
        found = np.empty((self.nodes[-1] + 1, 2 * self.states.shape[1]))
        found[self.nodes] = np.hstack([self.states, np.vstack([self.momenta, last])])
        found[np.setdiff1d(np.arange(len(found)), self.nodes)] = self.between
        return found


def descend_action(
    propagator: SegmentPropagator,
    first: int,  # phase of the first node, in pieces since the section
    points: Array,  # (nodes, 2n): guess of (q, p)
    *,
    last: float | None = None,  # duration of the last piece (s), if it differs from the others
    free: NDArray[np.bool_] | None = None,  # (n,): coordinates of the last state that may change; by default none
    closing: Closing | None = None,  # action after the last node, all of whose coordinates may change
    iterations: int = _ITERATIONS,  # at most
    converged: float = _CONVERGED,  # gain that the next step promises, relative to the action
) -> tuple[Array, float]:
    """Bring a path to a local minimum of the action, with extremal segments and its first state held.

    The action of a segment as a function of the states at its two nodes has the momenta as its derivatives, and blocks
    of the variational equations as its second derivatives: Newton's method on the sum has a banded matrix, and is
    damped where a step would not descend. It converges from farther away than multiple shooting, and to minima only.
    The states at nodes beside short contacts are not varied, so that an impact can move from one piece to the next.

    Returns the points (nodes, 2n) and the action: the guess and NaN where no extremal segments through its states were
    found.
    """
    path = _Descent(propagator, first, last, free, closing)
    current = path.through(points, path.chosen(points))
    if current is None:
        return points, float("nan")
    current = path.minimize(current, iterations, converged)
    return current.points, current.action


class _Descent:
    def __init__(
        self,
        propagator: SegmentPropagator,
        first: int,
        last: float | None,
        free: NDArray[np.bool_] | None,
        closing: Closing | None,
    ) -> None:
        n = propagator.size
        self.propagator, self.first, self.last, self.n = propagator, first, last, n
        self.held = np.full(n, closing is None) if free is None or closing is not None else ~free
        self.target, self.form = (np.zeros(n), np.zeros((n, n))) if closing is None else closing

    def chosen(self, points: Array) -> NDArray[np.intp]:
        """Choose the nodes whose states are varied: all but those next to a short contact."""
        left_out = self.propagator.in_short_contact(points, _BESIDE)
        left_out[-2:] = False
        return np.flatnonzero(~left_out)

    def through(self, points: Array, nodes: NDArray[np.intp]) -> _Evaluation | None:
        """Evaluate the path through the states at some nodes."""
        return self.evaluate(nodes, points[nodes, : self.n], points[nodes[:-1], self.n :])

    def evaluate(self, nodes: NDArray[np.intp], states: Array, momenta: Array) -> _Evaluation | None:
        """Find the momenta that lead from node to node; None where there are none near those given.

        Each segment has a Newton method of its own. A step that would miss the end by more is shortened: where a
        segment first touches a stop, steps from either side would lead to the other.
        """
        extent = np.ptp(states, axis=0)
        extent[extent == 0] = 1.0
        step, share = np.zeros_like(momenta), np.ones(len(momenta))
        least = np.full(len(momenta), np.inf)
        for _ in range(_INNER):
            tried = momenta + share[:, None] * step
            starts = np.hstack([states[:-1], tried])
            carried, between = self.propagator.extremal_between(starts, nodes, self.first, self.last)
            misses = states[1:] - carried.images[:, : self.n]
            missed = (np.abs(misses) / extent).max(axis=1)
            if np.all(missed <= _MATCHED):
                return _Evaluation(nodes, states, tried, carried, between, self._action(states, carried, misses))
            better = missed < least
            momenta, least = np.where(better[:, None], tried, momenta), np.fmin(least, missed)
            if not np.isfinite(least).all():
                return None
            slopes = carried.derivatives[better, : self.n, self.n :]
            step[better] = np.linalg.solve(slopes, misses[better, :, None])[..., 0]
            share = np.where(better, 1.0, share / 4)
        return None

    def _action(self, states: Array, carried: HamiltonianMap, misses: Array) -> float:
        """The action of a path; what its segments miss counts to first order."""
        tail = states[-1] - self.target
        missed = float(np.sum(carried.images[:, self.n :] * misses))
        return float(np.sum(carried.actions)) + missed + 0.5 * float(tail @ self.form @ tail)

    def minimize(self, current: _Evaluation, iterations: int, converged: float) -> _Evaluation:
        """Descend until the next step promises no more."""
        damping = _FIRST_DAMPING
        for _ in range(iterations):
            slope, (diagonal, below) = self._gradient(current), self._curvature(current)
            before = current.action
            count(newton_iterations=1)
            while damping < _MOST_DAMPING:
                step = _step(diagonal, below, slope, damping)
                tried, promised = None, 0.0
                if step is not None:
                    tried, promised = self._moved(current, step), -float(np.sum(slope * step)) / 2
                    if promised < converged * before:
                        return current
                gain = -1.0 if tried is None else (before - tried.action) / promised
                if gain < 0.25:
                    damping *= 4
                elif gain > 0.75:
                    damping = max(damping / 6, _LEAST_DAMPING)
                if tried is not None and gain > 0:
                    current = self._rearranged(tried)
                    break
            else:
                break
        return current

    def _rearranged(self, current: _Evaluation) -> _Evaluation:
        """Choose the nodes again, where impacts have moved."""
        points = current.points
        nodes = self.chosen(points)
        found = None if np.array_equal(nodes, current.nodes) else self.through(points, nodes)
        return current if found is None or found.action > current.action else found

    def _moved(self, current: _Evaluation, step: Array) -> _Evaluation | None:
        """Evaluate the path whose states are moved, its momenta moved to first order."""
        n, slopes = self.n, current.carried.derivatives
        ahead = step[1:] - np.einsum("kij,kj->ki", slopes[:, :n, :n], step[:-1])
        momenta = current.momenta + np.linalg.solve(slopes[:, :n, n:], ahead[..., None])[..., 0]
        return self.evaluate(current.nodes, current.states + step, momenta)

    def _gradient(self, current: _Evaluation) -> Array:
        """∂S/∂q at each node: the momentum before it less the one after it; 0 where the state is held."""
        outgoing = np.vstack([current.momenta, -(self.form @ (current.states[-1] - self.target))])
        slope = -outgoing
        slope[1:] += current.carried.images[:, self.n :]
        slope[0] = 0.0
        slope[-1, self.held] = 0.0
        return slope

    def _curvature(self, current: _Evaluation) -> tuple[Array, Array]:
        """Second derivatives: the blocks on the diagonal, and those below it."""
        n, slopes = self.n, current.carried.derivatives
        turn = np.linalg.inv(slopes[:, :n, n:])  # ∂p/∂q of a start, in the state at the end of its segment
        here = turn @ slopes[:, :n, :n]
        below = slopes[:, n:, :n] - slopes[:, n:, n:] @ here
        diagonal = np.concatenate([here, self.form[None]])
        diagonal[1:] += slopes[:, n:, n:] @ turn
        below = (below - turn.transpose(0, 2, 1)) / 2
        below[0] = 0.0
        below[-1, self.held] = 0.0
        diagonal[-1, self.held[:, None] != self.held] = 0.0
        return (diagonal + diagonal.transpose(0, 2, 1)) / 2, below


def _step(diagonal: Array, below: Array, slope: Array, damping: float) -> Array | None:
    """Newton step with damping relative to the size of the diagonal; None where it would not descend."""
    nodes, n = slope.shape
    values, vectors = np.linalg.eigh(diagonal)
    raised = diagonal + damping * np.einsum("kij,kj,klj->kil", vectors, np.abs(values), vectors)
    bands = np.zeros((2 * n, nodes * n))
    for i in range(n):
        for j in range(i + 1):
            bands[i - j, j::n] = raised[:, i, j]
        for j in range(n):
            bands[n + i - j, j : -n or None : n] = below[:, i, j]
    try:
        solved = scipy.linalg.solveh_banded(bands, -slope.ravel(), lower=True)
    except np.linalg.LinAlgError:
        return None
    return solved.reshape(nodes, n) if np.isfinite(solved).all() else None
