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
    HAMILTONIAN = "hamiltonian"
    """q, p, S"""
    HAMILTONIAN_VARIATIONAL = "hamiltonian_variational"
    """q, p, S, then ∂(q, p)/∂(q, p)₀ row by row"""
    NOISY = "noisy"
    """q under noise"""
