"""Attractors by label or by name."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from numbers import Integral
from typing import Any

from vibrokit.errors import StructureError, nearest, shown
from vibrokit.results.basins import ESCAPED

OUTSIDE = {-1: "exit", ESCAPED: "escape"}
"""Names of exits that lead to no attractor, by the label that stands for the goal."""


def exit_between(names: Sequence[str], source: int, target: int) -> str:
    """Return the names of the attractors between which an exit leads, such as ``"hammering → clear"``.

    The goal is ``"escape"`` for motion that leaves the region for good, and ``"exit"`` for another end that is no
    attractor.
    """
    return f"{names[source]} → {goal_name(names, target)}"


def goal_name(names: Sequence[str], target: int) -> str:
    """Return the name of what an exit leads to."""
    return names[target] if target >= 0 else OUTSIDE[target]


def goal_of(which: Any, names: Sequence[str]) -> int:
    """Return the label of what an exit leads to: of an attractor, as `label_of`, or −1 for "exit", −2 for "escape"."""
    for label, name in OUTSIDE.items():
        if which in (label, name):
            return label
    return label_of(which, names)


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


def source_among(known: Collection[int], which: Any, names: Sequence[str], what: str, of: str) -> int:
    """Return the label of an attractor of which something is known; by default the first one.

    `what` and `of` name the thing, such as ``"starts"`` and ``"from"``. Raises StructureError if it is not
    known of this attractor.
    """
    label = min(known) if which is None else label_of(which, names)
    if label not in known:
        have = ", ".join(names[other] for other in known)
        raise StructureError(f"the result has no {what} {of} {names[label]}; it has those {of} {have}.")
    return label
