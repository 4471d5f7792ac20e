"""The quasi-potential near a limit cycle: a quadratic form in the distance across it."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from vibrokit.errors import StructureError
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.vector_field import VectorField
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.structure.linear_map import gaussian_pieces

_NODES = 512  # along a cycle: a polyline through them is within about 2e-5 of its extent from it

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class CyclePotential:
    """Ψ = ½ (n·δq)²/σ², where n is normal to the motion, so that a shift along the cycle costs nothing."""

    nodes: Array  # (count, 2): states of the cycle at equal times
    normals: Array  # (count, 2): n at each of them, of length 1
    variances: Array  # (count,): σ², the stationary variance of n·δq per unit D there
    frequency: float  # ω_n (s⁻¹), by which x is multiplied to have a distance in (x, v)

    def at(self, states: Array) -> Array:
        """Return Ψ at states (…, 2), from the nearest node."""
        units = np.array([self.frequency, 1.0])
        place = cKDTree(self.nodes * units).query(states * units)[1]
        across = np.sum(self.normals[place] * (states - self.nodes[place]), axis=-1)
        potential: Array = 0.5 * across**2 / self.variances[place]
        return potential


def cycle_potential(osc: Oscillator, cycle: Attractor, stepper: Stepper) -> CyclePotential:
    """Linearize the motion under noise along a stable limit cycle, and solve for the stationary variance across it.

    n·δq is carried from node to node by a factor, since a displacement along the cycle remains one. Raises
    StructureError if the cycle does not attract.
    """
    nodes, pieces = gaussian_pieces(osc, cycle.points[0, :2], stepper, _NODES, _NODES, turn=cycle.duration)
    along = VectorField(osc).rate(nodes)
    normals = np.stack([-along[:, 1], along[:, 0]], axis=1) / np.linalg.norm(along, axis=1)[:, None]
    factors = np.einsum("ki,kij,kj->k", normals[1:], pieces.derivatives, normals[:-1])
    added = np.einsum("ki,kij,kj->k", normals[1:], pieces.covariances, normals[1:])
    shrunk, gathered = 1.0, 0.0
    for factor, more in zip(factors, added, strict=True):
        shrunk, gathered = factor * shrunk, factor**2 * gathered + more
    if not (abs(shrunk) < 1 and gathered > 0):
        raise StructureError(
            f"deviations across the limit cycle {cycle.name} change by a factor of {shrunk:.6g} in a turn, and noise "
            f"adds a variance of {gathered:.6g}; only a cycle that attracts and spreads has a quasi-potential near it."
        )
    variances = [gathered / (1 - shrunk**2)]
    for factor, more in zip(factors[:-1], added[:-1], strict=True):
        variances.append(factor**2 * variances[-1] + more)
    return CyclePotential(nodes[:-1], normals[:-1], np.array(variances), osc.natural_frequency)
