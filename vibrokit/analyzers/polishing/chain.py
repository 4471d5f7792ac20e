"""Chain: a guessed path made cheapest with its pieces priced by the noise they need, a robust least-squares problem."""

from __future__ import annotations

import dataclasses

import numpy as np
import scipy.sparse
import scipy.sparse.linalg
from numpy.typing import NDArray

from vibrokit.analyzers.polishing.carrier import Carrier, Linear
from vibrokit.errors import StructureError

_ITERATIONS = 80
_CONVERGED = 1e-3  # of the action, in one iteration
_FIRST_DAMPING, _MOST_DAMPING = 1e-6, 1e12

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class Chain:
    """A smoothed path.

    Attributes
    ----------
    points : array (nodes, 2n)
        (q, p) at each node.
    action : float
        Priced piece by piece by ½ eᵀC⁻¹e.
    """

    points: Array
    action: float


@dataclasses.dataclass(frozen=True, eq=False)
class _Look:
    """Residuals of a chain, and what they are made of."""

    linear: Linear
    weights: Array
    misses: Array

    @property
    def action(self) -> float:
        return 0.5 * float(np.sum(self.misses**2))


class _Smoother:
    """Levenberg and Marquardt's method on the states at the nodes, the first and last of which stay where they are."""

    def __init__(self, carrier: Carrier, first: int, last: float | None) -> None:
        self.carrier, self.first, self.last = carrier, first, last

    def look(self, states: Array) -> _Look | None:
        """Price a chain; None where its numbers run out of range."""
        linear = self.carrier.linear(states[:-1], self.first, self.last)
        if not (np.isfinite(linear.images).all() and np.isfinite(linear.gramians).all()):
            return None
        try:
            weights = np.linalg.inv(np.linalg.cholesky(linear.gramians))
        except np.linalg.LinAlgError:
            return None
        misses = np.einsum("kij,kj->ki", weights, states[1:] - linear.images)
        return _Look(linear, weights, misses)

    def slopes(self, look: _Look) -> scipy.sparse.csr_array:
        """Derivatives of all misses in the states between the ends; those of the weights are left out."""
        count, n = look.misses.shape
        inner, grid = np.arange(count - 1), np.arange(n)
        rows, columns, values = [], [], []
        for shift, blocks in ((0, look.weights[:-1]), (1, -(look.weights @ look.linear.steps)[1:])):
            rows.append(np.repeat(((inner + shift) * n)[:, None] + grid, n, axis=1).ravel())
            columns.append(np.tile((inner * n)[:, None] + grid, (1, n)).ravel())
            values.append(blocks.ravel())
        table = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
        return scipy.sparse.csr_array(table, shape=(count * n, (count - 1) * n))

    def smooth(self, states: Array) -> tuple[Array, _Look]:
        """Descend until the action no longer falls."""
        look = self.look(states)
        if look is None:
            raise StructureError("the guessed path runs out of range; give a finer one.")
        damping = _FIRST_DAMPING
        for _ in range(_ITERATIONS):
            slopes = self.slopes(look)
            downhill = -slopes.T @ look.misses.ravel()
            square = (slopes.T @ slopes).tocsc()
            before = look.action
            while damping < _MOST_DAMPING:
                raised = square + damping * scipy.sparse.diags_array(square.diagonal())
                step = scipy.sparse.linalg.splu(raised.tocsc(), permc_spec="NATURAL").solve(downhill)
                tried = states.copy()
                tried[1:-1] += step.reshape(tried[1:-1].shape)
                new = self.look(tried)
                if new is not None and new.action < before:
                    states, look, damping = tried, new, damping / 10
                    break
                damping *= 10
            else:
                break
            if before - look.action < _CONVERGED * look.action:
                break
        return states, look


def smooth_chain(carrier: Carrier, first: int, states: Array, last: float | None = None) -> Chain:
    """Make a guessed path the cheapest of its length, by the quadratic price of its pieces.

    Over a piece of an eighth of a period, ½ eᵀC⁻¹e is within some 0.2 % of the least action from one node to the next,
    e being the miss from the image without noise. The sum is one of squares, which Levenberg and Marquardt's method
    brings down from very poor guesses.

    Parameters
    ----------
    carrier : Carrier
    first : int
        Phase of the first node, in pieces since the section.
    states : array (nodes, n)
        The guess, a piece apart, three or more. The first and the last stay as they are.
    last : float, optional
        Length of the last piece (s), if it is not one like the others.

    Raises
    ------
    StructureError
        The guess runs out of range.
    """
    states, look = _Smoother(carrier, first, last).smooth(states)
    ends = np.einsum("kji,kj->ki", look.weights, look.misses)
    starts = np.einsum("kji,kj->ki", look.linear.steps, ends)
    return Chain(np.hstack([states, np.vstack([starts, ends[-1:]])]), look.action)
