"""Attractors by label or by name."""

from __future__ import annotations

from collections.abc import Sequence
from numbers import Integral
from typing import Any

from vibrokit.errors import StructureError, nearest, shown


def label_of(which: Any, names: Sequence[str], what: str = "attractor") -> int:
    """Return the label of an attractor given by its label, its name or the beginning of its name.

    `names` are those of all attractors, in the order of their labels. Raises StructureError if there is no such
    attractor, or if several names have this beginning.
    """
    if isinstance(which, str):
        matches = [label for label, name in enumerate(names) if name == which] or [
            label for label, name in enumerate(names) if which and name.startswith(which)
        ]
        if len(matches) == 1:
            return matches[0]
        if matches:
            raise StructureError(
                f"{which!r} can be {' or '.join(names[label] for label in matches)}; give a whole name."
            )
        raise StructureError(f"there is no {what} {which!r}{nearest(which, names)}")
    if isinstance(which, bool) or not isinstance(which, Integral) or not 0 <= int(which) < len(names):
        known = ", ".join(f"{label} ({name})" for label, name in enumerate(names))
        raise StructureError(f"there is no {what} {shown(which)}; there are {known}.")
    return int(which)
