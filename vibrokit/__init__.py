"""Stochastic stability of vibro-impact oscillators.

The public names below are loaded on first use, so that importing vibrokit is fast.
"""

import ast
from importlib import import_module
from pathlib import Path
from typing import Any

__version__ = "0.1.0"

# The module of each public name, as the stub beside this file imports it for type checkers.
_STUB = ast.parse(Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8"))
_IMPORTS = [node for node in _STUB.body if isinstance(node, ast.ImportFrom) and node.module != "typing"]
_MODULES = {alias.name: str(node.module) for node in _IMPORTS for alias in node.names}

__all__ = list(_MODULES)


def __getattr__(name: str) -> Any:
    if name in ("errors", "testing"):
        return import_module(f"vibrokit.{name}")
    if name not in _MODULES:
        raise AttributeError(f"module 'vibrokit' has no attribute {name!r}; it offers {', '.join(_MODULES)}.")
    value = getattr(import_module(_MODULES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_MODULES, "errors", "testing"})
