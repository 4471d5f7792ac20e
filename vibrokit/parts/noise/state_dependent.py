"""Noise whose amplitude depends on the state."""

from __future__ import annotations

from typing import Any, ClassVar

from vibrokit.parts.formula_part import FormulaPart
from vibrokit.parts.noise.noise_model import NoiseModel


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
