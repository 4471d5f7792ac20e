"""The quasi-potential near an attractor: a quadratic form, from the linearized map.

Around an orbit it is a form in the deviation; around a limit cycle, in the distance across it.
"""

from __future__ import annotations

import dataclasses
import warnings

import numpy as np
import scipy.linalg
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from vibrokit.errors import StructureError
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.vector_field import VectorField
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.structure.linear_map import gaussian_map, gaussian_pieces
from vibrokit.structure.orbits import Orbit

_PIECES = 16  # of a section interval
_SINGULAR = 1e-12  # least eigenvalue of a correlation matrix, as rounding errors may leave of 0
_NODES = 512  # along a cycle: a polyline through them is within about 2e-5 of its extent from it
_NEUTRAL = 1e-6  # distance of a multiplier from 1 below which nothing decays

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class LocalPotential:
    """Ψ = ½ δqᵀ Σ⁻¹ δq on the section, near a point of a stable orbit."""

    covariance: Array  # (n, n): Σ, the stationary covariance per unit D

    @property
    def stiffness(self) -> Array:
        """Σ⁻¹: the momentum at δq is p = Σ⁻¹ δq."""
        inverse = np.linalg.inv(self.covariance)
        return (inverse + inverse.T) / 2


@dataclasses.dataclass(frozen=True, eq=False)
class Phase:
    """The quadratic form at one time of an orbit, and what leads to it from the time before."""

    time: float  # since the section that the orbit starts on (s)
    point: Array  # (n,): of the orbit
    covariance: Array  # (n, n): Σ at that time
    monodromy: Array  # (n, n): M, derivative of the flow from the phase before to this one


def local_potential(osc: Oscillator, orbit: Orbit, stepper: Stepper) -> LocalPotential:
    """Linearize the motion under noise along a stable orbit, and solve for the stationary covariance.

    Raises
    ------
    StructureError
        The orbit is not stable, so that it has no stationary covariance; or noise does not make it spread.
    """
    found = gaussian_map(osc, orbit.point[None], stepper, intervals=orbit.period)
    return LocalPotential(_stationary(orbit, found.derivatives[0], found.covariances[0]))


def potential_along(osc: Oscillator, orbit: Orbit, stepper: Stepper, pieces: int = _PIECES) -> tuple[Phase, ...]:
    """Return the quadratic form at equal times along a stable orbit, `pieces` to a section interval, from its start on.

    From phase to phase Σ' = M Σ Mᵀ + C; the monodromy of the first phase leads to it from the last. Raises
    StructureError if the orbit is not stable.
    """
    nodes, linear = gaussian_pieces(osc, orbit.point, stepper, pieces, pieces * orbit.period)
    covariance = _stationary(orbit, *linear.composed())
    interval, phases = osc.section_interval / pieces, list[Phase]()
    before = np.roll(linear.derivatives, 1, axis=0)
    for number, (step, added) in enumerate(zip(linear.derivatives, linear.covariances, strict=True)):
        phases.append(Phase(number * interval, nodes[number], covariance, before[number]))
        covariance = step @ covariance @ step.T + added
    return tuple(phases)


def _stationary(orbit: Orbit, monodromy: Array, gathered: Array) -> Array:
    """Σ = M Σ Mᵀ + C at a point of an orbit, from the map over its period."""
    if not (np.isfinite(monodromy).all() and np.isfinite(gathered).all()):
        raise StructureError(
            f"the motion along the orbit at {tuple(orbit.point.tolist())} cannot be linearized; it may rest exactly "
            "where it touches a stop, or graze one, or the noise has no real value there."
        )
    largest = float(np.abs(np.linalg.eigvals(monodromy)).max())
    if not largest < 1 - _NEUTRAL:
        raise StructureError(
            f"the orbit at {tuple(orbit.point.tolist())} has a multiplier of size {largest:.6g}; only a stable one "
            "(all below 1) has a quasi-potential around it."
        )
    covariance = stationary_covariance(monodromy, gathered)
    sizes = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    if not (sizes.all() and np.linalg.eigvalsh(covariance / np.outer(sizes, sizes))[0] > _SINGULAR):
        raise StructureError(
            f"the noise is 0 along the orbit at {tuple(orbit.point.tolist())}, or nearly so: it does not spread the "
            "motion around the orbit in all directions, so that leaving it has no activation energy."
        )
    return covariance


def stationary_covariance(slope: Array, added: Array) -> Array:
    """Return Σ = M Σ Mᵀ + C. Where a multiplier is close to 1, Σ is as uncertain as it is large: that is no warning."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", scipy.linalg.LinAlgWarning)
        return np.asarray(scipy.linalg.solve_discrete_lyapunov(slope, added), dtype=np.float64)


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
    return CyclePotential(nodes[:-1], normals[:-1], np.array(variances), osc.reference_frequency)
