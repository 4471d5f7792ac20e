"""Barrier: a contact law with a position and a side."""

from __future__ import annotations

import dataclasses
from typing import Any, Literal, Self

from vibrokit.construction import Constructed
from vibrokit.errors import ParameterError, SceneError, shown
from vibrokit.parts.contact import ContactLaw
from vibrokit.parts.parameter import Parameter
from vibrokit.quantity import Quantity

_POSITION = Parameter("position", "position", "b", "m")


@dataclasses.dataclass(frozen=True)
class Barrier(metaclass=Constructed):
    """A stop: a contact law, its position, and its side of the mass.

    Parameters
    ----------
    law : ContactLaw
        Contact force as a function of depth and rate.
    position : float
        Position of the mass at first touch (m).
    side : {"right", "left"}
        ``"right"``: depth is x − position; ``"left"``: depth is position − x.
    adhesive : bool
        False: a negative (pulling) force, as of dissipative laws at release, is set to zero. True: it is kept.
    """

    law: ContactLaw
    position: float
    side: Literal["right", "left"]
    adhesive: bool = False

    def __post_init__(self) -> None:
        if not isinstance(self.law, ContactLaw):
            raise SceneError(
                f"Barrier: law must be a ContactLaw, such as Hertz(stiffness=50.0), got {shown(self.law)}."
            )
        if not isinstance(self.side, str) or self.side not in ("right", "left"):
            raise ParameterError(f"Barrier: side must be 'right' or 'left', got {shown(self.side)}.")
        if not isinstance(self.adhesive, bool):
            raise ParameterError(f"Barrier: adhesive must be True or False, got {shown(self.adhesive)}.")
        object.__setattr__(self, "position", _POSITION.checked("Barrier", self.position))

    @property
    def sign(self) -> int:
        """+1 for a right stop, −1 for a left stop: depth = sign · (x − position)."""
        return 1 if self.side == "right" else -1

    def declared(self) -> tuple[Parameter, ...]:
        """Parameters of the barrier itself, without those of its law."""
        return (_POSITION,)

    @property
    def parameters(self) -> dict[str, Any]:
        """Parameter values of the barrier itself, by name."""
        return {"position": self.position}

    @property
    def quantities(self) -> dict[str, Quantity]:
        """Parameter values of the barrier itself that were given with a unit, by name."""
        return {"position": self.position} if isinstance(self.position, Quantity) else {}

    def of_mass(self, mass: float | None) -> Self:
        """Return the stop in a scene of a mass (kg)."""
        law = self.law.of_mass(mass)
        return self if law is self.law else dataclasses.replace(self, law=law)

    def replace(self, **changes: Any) -> Self:
        """Return a checked copy with some fields changed."""
        return dataclasses.replace(self, **changes)
