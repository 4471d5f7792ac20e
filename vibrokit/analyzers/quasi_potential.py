"""The quasi-potential near an attractor: a quadratic form, from the linearised map."""

from __future__ import annotations

import dataclasses

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from vibrokit.errors import StructureError
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.structure.orbits import Orbit
from vibrokit.symbolic.flow_kind import Flow

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class LocalPotential:
    """Ψ = ½ δqᵀ Σ⁻¹ δq on the section, near a point of a stable orbit.

    Attributes
    ----------
    monodromy : array (n, n)
        M, derivative of the map over one period of the orbit.
    gramian : array (n, n)
        C, covariance (per D) that noise gathers in that time.
    covariance : array (n, n)
        Σ, the stationary one: Σ = M Σ Mᵀ + C.
    """

    monodromy: Array
    gramian: Array
    covariance: Array

    @property
    def stiffness(self) -> Array:
        """Σ⁻¹: the momentum at δq is p = Σ⁻¹ δq."""
        inverse = np.linalg.inv(self.covariance)
        return (inverse + inverse.T) / 2


def local_potential(osc: Oscillator, orbit: Orbit, stepper: Stepper) -> LocalPotential:
    """Linearise Hamilton's equations along a stable orbit, where p = 0, and solve for the covariance.

    Over one period the linearised flow is [[M, C M⁻ᵀ], [0, M⁻ᵀ]], which gives both M and the Gramian C.

    Raises
    ------
    StructureError
        The orbit is not stable, so that it has no stationary covariance.
    """
    size = len(orbit.point)
    start = np.concatenate([orbit.point, np.zeros(size + 1), np.eye(2 * size).ravel()])
    ended = run_ensemble(osc, Flow.HAMILTONIAN_VARIATIONAL, stepper, start[None], orbit.period)
    linear = ended.states[0, 2 * size + 1 :].reshape(2 * size, 2 * size)
    monodromy, upper = linear[:size, :size], linear[:size, size:]
    gramian = upper @ monodromy.T
    gramian = (gramian + gramian.T) / 2
    largest = float(np.abs(np.linalg.eigvals(monodromy)).max())
    if largest >= 1:
        raise StructureError(
            f"the orbit at {tuple(orbit.point)} has a multiplier of size {largest:.6g}; only a stable one "
            "(all below 1) has a quasi-potential round it."
        )
    return LocalPotential(monodromy, gramian, scipy.linalg.solve_discrete_lyapunov(monodromy, gramian))
