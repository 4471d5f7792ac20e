"""Barrier: a contact law put somewhere."""

from __future__ import annotations

import dataclasses
from typing import Any, Literal, Self

from vibrokit.errors import ParameterError, SceneError, shown
from vibrokit.parts.contact.contact_law import ContactLaw
from vibrokit.parts.parameter import Parameter

_POSITION = Parameter("position", "position", "b", "m")


@dataclasses.dataclass(frozen=True)
class Barrier:
    """A stop: a contact law, its place, and the side of the mass that it is on.

    Parameters
    ----------
    law : ContactLaw
        How hard it pushes back.
    position : float
        Where the mass touches it (m).
    side : {"right", "left"}
        ``"right"``: depth is x − position; ``"left"``: depth is position − x.
    adhesive : bool
        False: a law that would pull (dissipative laws, at release) is cut at zero. True: it may pull.
    """

    law: ContactLaw
    position: float
    side: Literal["right", "left"]
    adhesive: bool = False

    def __post_init__(self) -> None:
        if not isinstance(self.law, ContactLaw):
            raise SceneError(
                f"Barrier: law is {shown(self.law)}, which is no contact law; give one, such as Hertz(stiffness=50.0)."
            )
        if self.side not in ("right", "left"):
            raise ParameterError(f"Barrier: side is {shown(self.side)}; give 'right' or 'left'.")
        if not isinstance(self.adhesive, bool):
            raise ParameterError(f"Barrier: adhesive is {shown(self.adhesive)}; give True or False.")
        object.__setattr__(self, "position", _POSITION.checked("Barrier", self.position))

    @property
    def sign(self) -> int:
        """+1 for a right stop, −1 for a left one: depth = sign · (x − position)."""
        return 1 if self.side == "right" else -1

    def declared(self) -> tuple[Parameter, ...]:
        """Parameters of the barrier itself, those of its law apart."""
        return (_POSITION,)

    @property
    def parameters(self) -> dict[str, Any]:
        """Parameter values of the barrier itself, by name."""
        return {"position": self.position}

    def replace(self, **changes: Any) -> Self:
        """Return a copy with some fields changed, checked like new ones."""
        return dataclasses.replace(self, **changes)
