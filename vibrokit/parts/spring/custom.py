"""A spring by formula."""

from __future__ import annotations

from typing import Any, ClassVar

from vibrokit.parts.formula_part import FormulaPart
from vibrokit.parts.spring.spring import Spring


class CustomSpring(FormulaPart, Spring):
    """Spring given as a formula in ``x`` and ``v``; nonlinear damping may be part of it.

    Parameters
    ----------
    formula : str
        Arithmetic, numbers, constants and the functions of `vibrokit.parts.formula`; read as data, never run.
    **constants : float
        Values of the names that the formula uses.

    Examples
    --------
    >>> CustomSpring("x + e*x**5", e=0.2)
    CustomSpring(formula='x + e*x**5', e=0.2)
    """

    variables: ClassVar[tuple[str, ...]] = ("x", "v")

    formula: str
    constants: tuple[tuple[str, Any], ...]

    def __init__(self, /, formula: str, **constants: float) -> None:
        self._read(formula, constants)

    def force(self, x: Any, v: Any) -> Any:
        """Restoring force, as the formula says."""
        return self._evaluate(x, v)
