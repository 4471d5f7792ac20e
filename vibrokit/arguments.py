"""Arguments, which may be of any type: read as a number, as a sequence, or as the path of a file."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from numbers import Real
from pathlib import Path
from typing import Any

from vibrokit.errors import ArgumentError, shown


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
