"""What decides whether a compiled kernel fits a scene: the code of its parts, not their numbers.

Computed from bytecode, so that it works for classes typed at a prompt and needs no SymPy.
"""

from __future__ import annotations

import functools
import hashlib
import importlib.metadata
import inspect
import sys
import types
from pathlib import Path
from typing import Any

from vibrokit.parts.scene import Scene

_PACKAGES = ("sympy", "numba", "llvmlite", "numpy")
_EMITTERS = ("parts", "symbolic", "kernels")


def scene_fingerprint(scene: Scene) -> str:
    """Return text that is equal for two scenes exactly if the same generated code serves both."""
    rows = [_environment()]
    rows += ["" if scene.spring is None else _part(scene.spring)]
    rows += [f"{barrier.side} {barrier.adhesive} {_part(barrier.law)}" for barrier in scene.barriers]
    rows += [_part(excitation) for excitation in scene.excitations]
    rows += ["" if scene.noise is None else _part(scene.noise)]
    rows += [entry.path for entry in scene.entries()]
    return "\n".join(rows)


@functools.cache
def _environment() -> str:
    """Versions of everything that writes or compiles code, and the text of our own part of it."""
    digest = hashlib.sha256()
    root = Path(__file__).parents[1]
    for folder in _EMITTERS:
        for path in sorted((root / folder).rglob("*.py")):
            digest.update(path.read_bytes())
    versions = [f"{name} {importlib.metadata.version(name)}" for name in _PACKAGES]
    return " ".join([sys.version, *versions, digest.hexdigest()])


def _part(part: Any) -> str:
    structural = [(d.name, part.parameters[d.name]) for d in part.declared() if d.structural]
    declared = [(d.name, d.symbol, d.minimum, d.above, d.structural) for d in part.declared()]
    return f"{structural} {declared} {_class(type(part), frozenset())}"


def _class(cls: type, seen: frozenset[int]) -> str:
    rows = []
    for owner in cls.__mro__:
        if owner is object or owner.__module__.startswith("abc"):
            continue
        rows.append(f"{owner.__module__}.{owner.__qualname__}")
        for name, value in sorted(vars(owner).items()):
            if not (name.startswith("__") and name.endswith("__")):
                rows.append(f"{name}={_value(value, seen)}")
    return hashlib.sha256("\n".join(rows).encode()).hexdigest()


def _value(value: Any, seen: frozenset[int]) -> str:
    """Describe something that a formula may depend on: followed into functions, by value for plain data."""
    if id(value) in seen:
        return "…"
    seen = seen | {id(value)}
    if isinstance(value, property):
        return _value(value.fget, seen)
    if isinstance(value, staticmethod | classmethod):
        return _value(value.__func__, seen)
    if isinstance(value, types.FunctionType):
        return _function(value, seen)
    if isinstance(value, types.ModuleType):
        return f"module {value.__name__} {getattr(value, '__version__', '')}"
    if inspect.isclass(value):
        return f"{value.__module__}.{value.__qualname__}"
    if isinstance(value, bool | int | float | complex | str | bytes | tuple | list | dict | type(None)):
        return repr(value)
    return f"{type(value).__module__}.{type(value).__qualname__}"


def _function(function: types.FunctionType, seen: frozenset[int]) -> str:
    rows = [_code(function.__code__)]
    names = sorted(set(_names(function.__code__)) & set(function.__globals__))
    if not function.__module__.startswith("vibrokit."):
        rows += [f"{name}={_value(function.__globals__[name], seen)}" for name in names]
    rows += [_value(cell.cell_contents, seen) for cell in function.__closure__ or () if _filled(cell)]
    rows += [_value(value, seen) for value in (*(function.__defaults__ or ()), *(function.__kwdefaults__ or {}).values())]
    return hashlib.sha256("\n".join(rows).encode()).hexdigest()


def _filled(cell: Any) -> bool:
    try:
        cell.cell_contents  # noqa: B018 - an empty cell raises
    except ValueError:
        return False
    return True


def _names(code: types.CodeType) -> tuple[str, ...]:
    inner = [name for constant in code.co_consts if inspect.iscode(constant) for name in _names(constant)]
    return (*code.co_names, *inner)


def _code(code: types.CodeType) -> str:
    constants = [_code(c) if inspect.iscode(c) else repr(c) for c in code.co_consts]
    return f"{code.co_code.hex()} {constants} {code.co_names} {code.co_varnames} {code.co_freevars}"
