"""Exits by name, as the command line has them."""

from __future__ import annotations

from vibrokit.analyzers.exits import Exit, FirstContact, LeaveBasin
from vibrokit.errors import StructureError, nearest

_NAMES = ("leave-basin", "first-contact")


def named_exit(text: str) -> Exit:
    """Read an exit from its name: ``leave-basin``, ``first-contact``, ``first-contact:right``.

    Raises
    ------
    StructureError
        An unknown name, or a side that is none.
    """
    name, colon, side = text.partition(":")
    if name not in _NAMES:
        raise StructureError(f"exit {text!r}: there is no {name!r}{nearest(name, _NAMES)}")
    if name == "first-contact":
        return FirstContact(side if colon else None)
    if colon:
        raise StructureError(f"exit {text!r}: leaving a basin has no side; give leave-basin or first-contact:{side}.")
    return LeaveBasin()
