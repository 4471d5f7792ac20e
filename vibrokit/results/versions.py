"""Versions of the toolkit and of the libraries it uses."""

from __future__ import annotations

import importlib.metadata
import platform

_LIBRARIES = ("vibrokit", "numpy", "scipy", "sympy", "numba")


def versions() -> dict[str, str]:
    """Return the versions by name."""
    return {"python": platform.python_version()} | {name: importlib.metadata.version(name) for name in _LIBRARIES}
