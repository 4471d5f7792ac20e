"""Contact law given as a formula."""

from __future__ import annotations

from typing import Any

from vibrokit.parts.contact.contact_law import ContactLaw
from vibrokit.parts.formula import evaluate
from vibrokit.parts.formula_part import FormulaPart


class CustomLaw(FormulaPart, ContactLaw):
    """Contact law given as a formula in ``depth`` and ``rate``.

    Parameters
    ----------
    formula : str
        Arithmetic, numbers, constants and the functions of `vibrokit.parts.formula`; it is never run as code.
    **constants : float
        Values of the other names in the formula.

    Examples
    --------
    >>> CustomLaw("k*depth**1.5 + c*depth*rate", k=50.0, c=0.1)
    CustomLaw(formula='k*depth**1.5 + c*depth*rate', k=50.0, c=0.1)
    """

    formula: str
    constants: tuple[tuple[str, Any], ...]

    def __init__(self, /, formula: str, **constants: float) -> None:
        self._read(formula, constants)

    def touch(self) -> tuple[bool, ...]:
        """Whether the force at depth 0 vanishes, at rates −1, 0 and 1."""
        values = dict(self.constants)
        forces = (evaluate(self.formula, values | {"depth": 0.0, "rate": rate}) for rate in (-1.0, 0.0, 1.0))
        return tuple(force == 0 for force in forces)

    def force(self, depth: Any, rate: Any) -> Any:
        """Force on the mass: the formula."""
        return self._evaluate(depth, rate)
