"""Versions of the toolkit and of what it stands on."""

from __future__ import annotations

import importlib.metadata
import platform

_STANDING_ON = ("vibrokit", "numpy", "scipy", "sympy", "numba")


def versions() -> dict[str, str]:
    """Return the version of each by its name."""
    return {"python": platform.python_version()} | {name: importlib.metadata.version(name) for name in _STANDING_ON}
