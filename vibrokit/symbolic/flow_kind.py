"""Flow: which equations are integrated together."""

import enum


class Flow(enum.Enum):
    """Sets of equations; each becomes a compiled kernel of its own when first asked for.

    In all of them the state q (x, v, extra noise states) comes first.
    """

    STATE = "state"
    """q"""
    STATE_VARIATIONAL = "state_variational"
    """q, then ∂q/∂q₀ row by row"""
    STATE_REVERSED = "state_reversed"
    """q backwards in time, with −v in place of v; time t₀ is started from as −t₀"""
    GRAMIAN = "gramian"
    """q, then the upper triangle, row by row, of the covariance C that noise gathers per D: C′ = A C + C Aᵀ + a"""
    GRAMIAN_REVERSED = "gramian_reversed"
    """the same of the motion backwards; with R = diag(1, −1, 1, …), R C R is then M⁻¹ C M⁻ᵀ of the motion forwards"""
    HAMILTONIAN = "hamiltonian"
    """q, p, S"""
    HAMILTONIAN_VARIATIONAL = "hamiltonian_variational"
    """q, p, S, then ∂(q, p)/∂(q, p)₀ row by row"""
    NOISY = "noisy"
    """q under noise"""

    @property
    def reversed(self) -> bool:
        """Whether the motion is followed backwards in time."""
        return self in (Flow.STATE_REVERSED, Flow.GRAMIAN_REVERSED)

    @property
    def has_momenta(self) -> bool:
        """Whether momenta are among the variables."""
        return self in (Flow.HAMILTONIAN, Flow.HAMILTONIAN_VARIATIONAL)

    @property
    def has_covariance(self) -> bool:
        """Whether the covariance C is among the variables."""
        return self in (Flow.GRAMIAN, Flow.GRAMIAN_REVERSED)
