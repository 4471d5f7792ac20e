"""Arguments, which may be of any type: read as a number, as a sequence, or as the path of a file."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from numbers import Integral, Real
from pathlib import Path
from typing import Any

from vibrokit.errors import ArgumentError, StructureError, shown

MOST_CELLS = 10**9
"""Of a grid of any kind, and the largest of other counts of that sort."""


def real(value: Any) -> float:
    """Return an argument as a float; NaN if it is not a number, infinity if it is too large."""
    if isinstance(value, bool) or not isinstance(value, Real):
        return math.nan
    try:
        return float(value)
    except OverflowError:
        return math.inf


def members(values: Any) -> tuple[Any, ...] | None:
    """Return the members of a sequence; None for any other argument, such as a text or a table."""
    if isinstance(values, str | bytes | Mapping):
        return None
    try:
        return tuple(values)
    except TypeError:  # an array of no dimension has __iter__ too
        return None


def path_of(path: Any) -> Path:
    """Return the path of a file; raises ArgumentError for anything else."""
    if not isinstance(path, str | os.PathLike) or isinstance(os.fspath(path), bytes) or not os.fspath(path):
        raise ArgumentError(f"a file is given by its path, as text or a pathlib.Path, got {shown(path)}.")
    return Path(path)


def whole(name: str, number: Any, least: int, most: int) -> int:
    """Return a whole number; a StructureError is raised if it is not one, or out of bounds."""
    if isinstance(number, bool) or not isinstance(number, Integral) or not least <= int(number) <= most:
        raise StructureError(f"{name} must be a whole number from {least} to {most}, got {shown(number)}.")
    return int(number)


def pair(name: str, counts: Any, most: int = MOST_CELLS, least: int = 1) -> tuple[int, int]:
    """Return two whole numbers of at least some size, whose product is within bounds; raises StructureError."""
    try:
        first, second = (whole(name, count, least, most) for count in counts)
    except (TypeError, ValueError, StructureError):
        first = second = most + 1
    if first * second > most:
        raise StructureError(
            f"{name} must be two whole numbers, {least} or more, whose product is at most {most}, got {shown(counts)}."
        )
    return first, second
