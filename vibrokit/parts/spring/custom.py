"""Spring given as a formula."""

from __future__ import annotations

from typing import Any

from vibrokit.parts.formula_part import FormulaPart
from vibrokit.parts.spring.spring import Spring


class CustomSpring(FormulaPart, Spring):
    """Spring given as a formula in ``x`` and ``v``, nonlinear damping included.

    Motion ends at the poles of the formula and at the edges of its domain.

    Dry friction is given in a smooth form: ``f*tanh(v/w)`` with a small width w, not ``f*sign(v)``, which is refused.

    Parameters
    ----------
    formula : str
        Arithmetic, numbers, constants and the functions of `vibrokit.parts.formula`; it is never run as code.
    **constants : float
        Values of the other names in the formula.

    Examples
    --------
    >>> CustomSpring("x + e*x**5", e=0.2)
    CustomSpring(formula='x + e*x**5', e=0.2)
    """

    formula: str
    constants: tuple[tuple[str, Any], ...]

    def __init__(self, /, formula: str, **constants: float) -> None:
        self._read(formula, constants)

    def force(self, x: Any, v: Any) -> Any:
        """Restoring force: the formula."""
        return self._evaluate(x, v)
