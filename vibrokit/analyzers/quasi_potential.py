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

_PIECES = 16

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

    Over a time the linearised flow is [[M, C M⁻ᵀ], [0, M⁻ᵀ]], which gives both M and the Gramian C. The period is cut
    into pieces, for M⁻ᵀ grows as fast as M decays and would bury C in rounding errors: C = Σ M' C_piece M'ᵀ, M' leading
    from the end of the piece to the end of the period.

    Raises
    ------
    StructureError
        The orbit is not stable, so that it has no stationary covariance.
    """
    size = len(orbit.point)
    interval = osc.section_interval / _PIECES
    point, monodromy, gramian = orbit.point, np.eye(size), np.zeros((size, size))
    for piece in range(_PIECES * orbit.period):
        start = np.concatenate([point, np.zeros(size + 1), np.eye(2 * size).ravel()])
        begin = (piece % _PIECES) * interval
        ended = run_ensemble(
            osc, Flow.HAMILTONIAN_VARIATIONAL, stepper, start[None], 1, start_time=begin, interval=interval
        )
        point = ended.states[0, :size]
        linear = ended.states[0, 2 * size + 1 :].reshape(2 * size, 2 * size)
        step, upper = linear[:size, :size], linear[:size, size:]
        gathered = upper @ step.T
        monodromy, gramian = step @ monodromy, step @ gramian @ step.T + (gathered + gathered.T) / 2
    largest = float(np.abs(np.linalg.eigvals(monodromy)).max())
    if not largest < 1:
        raise StructureError(
            f"the orbit at {tuple(orbit.point)} has a multiplier of size {largest:.6g}; only a stable one "
            "(all below 1) has a quasi-potential round it."
        )
    return LocalPotential(monodromy, gramian, scipy.linalg.solve_discrete_lyapunov(monodromy, gramian))
