"""Spring: the restoring force at every displacement."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, ClassVar

from vibrokit.parts.part import Part


class Spring(Part):
    """Restoring force per unit mass, x″ = … − force(x, v). Abstract."""

    variables: ClassVar[tuple[str, ...]] = ("x", "v")

    @abstractmethod
    def force(self, x: Any, v: Any) -> Any:
        """Force (m s⁻²) at displacement `x` (m) and velocity `v` (m s⁻¹), as a SymPy expression.

        It must not jump in `v`, as dry friction does: write f*tanh(v/w) for f*sign(v), with a small width w. Nor in
        `x`: there, a stop may have the jump at first touch. The derivation of the equations raises DerivationError
        otherwise.
        """
