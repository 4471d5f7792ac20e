"""Contact law given as a formula."""

from __future__ import annotations

from typing import Any, ClassVar

from vibrokit.parts.contact.contact_law import ContactLaw
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

    variables: ClassVar[tuple[str, ...]] = ("depth", "rate")

    formula: str
    constants: tuple[tuple[str, Any], ...]

    def __init__(self, /, formula: str, **constants: float) -> None:
        self._read(formula, constants)

    def force(self, depth: Any, rate: Any) -> Any:
        """Force on the mass: the formula."""
        return self._evaluate(depth, rate)
