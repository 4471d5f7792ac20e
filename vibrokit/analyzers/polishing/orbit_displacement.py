"""OrbitDisplacement: how an orbit moves when a parameter of the scene changes."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
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
