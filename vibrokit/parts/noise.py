"""Noise: the random force."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from typing import Any, ClassVar

from vibrokit.parts.formula_part import FormulaPart
from vibrokit.parts.parameter import parameter
from vibrokit.parts.part import Part


class NoiseModel(Part):
    """Random force of intensity D, in the Itô sense. Abstract.

    White noise drives the velocity: dv = … dt + amplitude(x, v) √D dW. A model with extra states (coloured noise)
    names them in `extra_states`, as it likes; then the white noise drives the last of these, `drift` gives their rates
    without noise, and `force` gives their force on the mass.

    For developers
    --------------
    `amplitude` alone is a complete model. With `extra_states`, write `force` and `drift` as well. None of them may jump
    in a state; the derivation of the equations refuses that.
    """

    variables: ClassVar[tuple[str, ...]] = ("x", "v")
    extra_states: ClassVar[tuple[str, ...]] = ()

    intensity: float = parameter("D", "m^2 s^-3", minimum=0)

    @abstractmethod
    def amplitude(self, x: Any, v: Any) -> Any:
        """Factor of √D dW, as a SymPy expression in displacement and velocity."""

    def formulas(self, argument: Callable[[str], Any]) -> tuple[Any, ...]:
        """Return the amplitude, and the force and the rates of the extra states."""
        plane, extra = map(argument, self.variables), tuple(map(argument, self.extra_states))
        x, v = plane
        return (self.amplitude(x, v), self.force(*extra), *self.drift(x, v, *extra))

    def force(self, *extra: Any) -> Any:
        """Force of the extra states on the mass (m s⁻²)."""
        return 0

    def drift(self, x: Any, v: Any, *extra: Any) -> tuple[Any, ...]:
        """Rates of the extra states without noise, one per state."""
        return ()


class WhiteNoise(NoiseModel):
    """Gaussian white noise ξ on the velocity, ⟨ξ(t) ξ(t+τ)⟩ = D δ(τ).

    Parameters
    ----------
    intensity : float
        D, in m² s⁻³, not negative.
    """

    def amplitude(self, x: Any, v: Any) -> Any:
        """Factor before √D dW: 1 everywhere."""
        return 1


class StateDependentNoise(FormulaPart, NoiseModel):
    """Itô white noise on the velocity, √D g(x, v) dW, with g given as a formula in ``x`` and ``v``.

    Parameters
    ----------
    intensity : float
        D, in m² s⁻³, not negative.
    amplitude : str
        Formula of g; it is never run as code.
    **constants : float
        Values of the other names in the formula.

    Examples
    --------
    >>> StateDependentNoise(1e-4, "1 + c*x**2", c=0.5)
    StateDependentNoise(intensity=0.0001, amplitude='1 + c*x**2', c=0.5)
    """

    formula_name: ClassVar[str] = "amplitude"

    formula: str
    constants: tuple[tuple[str, Any], ...]

    def __init__(self, /, intensity: float, amplitude: str, **constants: float) -> None:
        (declared,) = self._own()
        object.__setattr__(self, "intensity", declared.checked(type(self).__name__, intensity))
        self._read(amplitude, constants)

    def amplitude(self, x: Any, v: Any) -> Any:
        """Factor of √D dW: the formula."""
        return self._evaluate(x, v)
