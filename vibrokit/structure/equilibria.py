"""Equilibria of scenes without periodic excitation, and their eigenvalues, from the exact vector field."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from vibrokit.errors import StructureError
from vibrokit.kernels.vector_field import VectorField
from vibrokit.oscillator import Oscillator
from vibrokit.structure.newton import Evaluation, newton
from vibrokit.structure.orbits import CONVERGED, Orbit
from vibrokit.structure.scales import size_of

_PARTS_OF_A_TURN = 16  # of 2π/ω_n, over which the motion at an equilibrium is linearised
AT_REST = 1e-6
"""Largest relative motion of a state that counts as an equilibrium."""

Array = NDArray[np.float64]


def equilibrium_equations(osc: Oscillator) -> Callable[[Array], Evaluation]:
    """Return the equations of an equilibrium, b τ = 0 with τ a sixteenth of 2π/ω_n; attached is the Jacobian of b τ."""
    field, time = VectorField(osc), osc.section_interval / _PARTS_OF_A_TURN

    def evaluate(states: Array) -> Evaluation:
        jacobians = time * field.jacobian(states)
        return Evaluation(time * field.rate(states), jacobians, jacobians)

    return evaluate


def refine_equilibrium(osc: Oscillator, guess: Array) -> Orbit:
    """Refine an equilibrium by Newton's method on the vector field until the residual no longer falls.

    Returns
    -------
    Orbit
        Of period 1. Its monodromy matrix is that over a sixteenth of 2π/ω_n, in which deviations stay moderate, and
        its residual is the distance that its rate of change would cover in that time.

    Raises
    ------
    StructureError
        A scene with periodic excitation, or no equilibrium near the guess.
    """
    refuse_forcing(osc)
    (point,), (residual,), (jacobian,) = newton(equilibrium_equations(osc), guess[None])
    if not residual <= CONVERGED * (size_of(osc) + float(np.linalg.norm(guess))):
        raise StructureError(
            f"Newton's method found no equilibrium near {tuple(np.round(guess, 6).tolist())}: the residual is "
            f"{residual:.1e}; start nearer to one."
        )
    # Balanced, for a stiff stop makes the rate of v huge in units of x, which would cost as many digits.
    balanced, units = scipy.linalg.matrix_balance(jacobian, permute=False)
    monodromy = units @ scipy.linalg.expm(balanced) @ np.linalg.inv(units)
    return Orbit(point, 1, monodromy, float(residual))


def equilibrium_exponents(osc: Oscillator, point: Array) -> NDArray[np.complex128]:
    """Return the eigenvalues of the vector field's Jacobian at an equilibrium.

    Parameters
    ----------
    osc : Oscillator
        Without periodic excitation.
    point : array (n,)
        The equilibrium.

    Returns
    -------
    complex array (n,)
        In s⁻¹, the fastest growing first.

    Raises
    ------
    StructureError
        A scene with periodic excitation, or a point that is not at rest.
    """
    refuse_forcing(osc)
    place, field = np.array(point, dtype=float), VectorField(osc)
    exponents = np.linalg.eigvals(field.jacobian(place)).astype(complex)
    speed = float(np.linalg.norm(field.rate(place)))
    fastest = max(float(np.abs(exponents).max()), 1.0 / osc.time_unit)
    if not speed <= AT_REST * fastest * (size_of(osc) + float(np.linalg.norm(place))):
        raise StructureError(
            f"{tuple(np.round(place, 6).tolist())} is not an equilibrium: the state moves at {speed:.2e} per second "
            "there; give a point at rest."
        )
    return exponents[np.argsort(-exponents.real, kind="stable")]


def refuse_forcing(osc: Oscillator) -> None:
    """Raise StructureError for a scene with periodic excitation."""
    if not osc.autonomous:
        raise StructureError(
            f"the scene has periodic excitation (period {osc.section_interval:.6g} s), and only scenes without it "
            "have cycles and equilibria; ask for its periodic orbits."
        )
