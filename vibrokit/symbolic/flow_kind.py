"""Flow: which equations are integrated together."""

import enum


class Flow(enum.Enum):
    """Sets of equations; each is compiled to its own kernel on first use.

    The state q (x, v, extra noise states) comes first in all of them.
    """

    STATE = "state"
    """q"""
    STATE_VARIATIONAL = "state_variational"
    """q, then M = ∂q/∂q₀ row by row"""
    STATE_REVERSED = "state_reversed"
    """q backwards in time, with −v in place of v; a start at time t₀ is given as −t₀"""
    LINEARISED = "linearised"
    """q, then M row by row, then the upper triangle, row by row, of the covariance C of the noise per unit D:
    C′ = A C + C Aᵀ + a with A = ∂b/∂q"""
    COVARIANCE_REVERSED = "covariance_reversed"
    """q backwards in time as in STATE_REVERSED, then the upper triangle of its covariance C per unit D; with
    R = diag(1, −1, 1, …), R C R is M⁻¹ C M⁻ᵀ of the forward motion"""
    HAMILTONIAN = "hamiltonian"
    """q, p, S"""
    HAMILTONIAN_VARIATIONAL = "hamiltonian_variational"
    """q, p, S, then ∂(q, p)/∂(q, p)₀ row by row"""
    NOISY = "noisy"
    """q with noise"""

    @property
    def reversed(self) -> bool:
        """Whether time runs backwards."""
        return self in (Flow.STATE_REVERSED, Flow.COVARIANCE_REVERSED)

    @property
    def has_momenta(self) -> bool:
        """Whether momenta are among the variables."""
        return self in (Flow.HAMILTONIAN, Flow.HAMILTONIAN_VARIATIONAL)

    @property
    def has_covariance(self) -> bool:
        """Whether the covariance C is among the variables."""
        return self in (Flow.LINEARISED, Flow.COVARIANCE_REVERSED)

    @property
    def has_derivatives(self) -> bool:
        """Whether M = ∂q/∂q₀, without momenta, is among the variables."""
        return self in (Flow.STATE_VARIATIONAL, Flow.LINEARISED)

    @property
    def differentiates(self) -> bool:
        """Whether derivatives of forces are integrated."""
        return self.has_momenta or self.has_covariance or self.has_derivatives
