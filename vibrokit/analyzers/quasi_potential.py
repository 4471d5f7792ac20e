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
_NEUTRAL = 1e-6  # of a multiplier: so near to 1 that nothing decays

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


@dataclasses.dataclass(frozen=True, eq=False)
class Phase:
    """The quadratic form at one time of an orbit, and what leads to it from the time before.

    Attributes
    ----------
    time : float
        Since the section that the orbit starts on (s).
    point : array (n,)
        Of the orbit.
    covariance : array (n, n)
        Σ at that time.
    monodromy : array (n, n)
        M, derivative of the flow from the phase before to this one.
    """

    time: float
    point: Array
    covariance: Array
    monodromy: Array


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
    return _closed(orbit, _pieces(osc, orbit, stepper))


def potential_along(osc: Oscillator, orbit: Orbit, stepper: Stepper) -> tuple[Phase, ...]:
    """Return the quadratic form at 16 times of each section interval of a stable orbit, the first the orbit's start.

    From phase to phase Σ' = M Σ Mᵀ + C; the monodromy of the first phase leads to it from the last.

    Raises
    ------
    StructureError
        The orbit is not stable.
    """
    pieces = _pieces(osc, orbit, stepper)
    covariance = _closed(orbit, pieces).covariance
    phases = []
    for piece in pieces:
        phases.append(Phase(piece.time, piece.point, covariance, piece.before))
        covariance = piece.monodromy @ covariance @ piece.monodromy.T + piece.gramian
    return tuple(phases)


@dataclasses.dataclass(frozen=True, eq=False)
class _Piece:
    """A short part of the orbit: where it starts, M over the piece before, and M and C over it."""

    time: float
    point: Array
    before: Array
    monodromy: Array
    gramian: Array


def _pieces(osc: Oscillator, orbit: Orbit, stepper: Stepper) -> list[_Piece]:
    size = len(orbit.point)
    interval = osc.section_interval / _PIECES
    point = orbit.point
    pieces: list[_Piece] = []
    for number in range(_PIECES * orbit.period):
        start = np.concatenate([point, np.zeros(size + 1), np.eye(2 * size).ravel()])
        begin = (number % _PIECES) * interval
        ended = run_ensemble(
            osc, Flow.HAMILTONIAN_VARIATIONAL, stepper, start[None], 1, start_time=begin, interval=interval
        )
        linear = ended.states[0, 2 * size + 1 :].reshape(2 * size, 2 * size)
        step, upper = linear[:size, :size], linear[:size, size:]
        gathered = upper @ step.T
        before = pieces[-1].monodromy if pieces else step
        pieces.append(_Piece(number * interval, point, before, step, (gathered + gathered.T) / 2))
        point = ended.states[0, :size]
    pieces[0] = dataclasses.replace(pieces[0], before=pieces[-1].monodromy)
    return pieces


def _closed(orbit: Orbit, pieces: list[_Piece]) -> LocalPotential:
    size = len(orbit.point)
    monodromy, gramian = np.eye(size), np.zeros((size, size))
    for piece in pieces:
        monodromy = piece.monodromy @ monodromy
        gramian = piece.monodromy @ gramian @ piece.monodromy.T + piece.gramian
    largest = float(np.abs(np.linalg.eigvals(monodromy)).max())
    if not largest < 1 - _NEUTRAL:
        raise StructureError(
            f"the orbit at {tuple(orbit.point.tolist())} has a multiplier of size {largest:.6g}; only a stable one "
            "(all below 1) has a quasi-potential round it."
        )
    return LocalPotential(monodromy, gramian, scipy.linalg.solve_discrete_lyapunov(monodromy, gramian))
