"""Fingerprint of a scene: the code of its parts, without parameter values. It decides which compiled kernel fits.

It is computed from bytecode, so that it works for classes typed at a prompt and needs no SymPy.
"""

from __future__ import annotations

import functools
import hashlib
import importlib.metadata
import inspect
import os
import pickle
import sys
import types
from pathlib import Path
from typing import Any

from vibrokit.parts.scene import Scene

_PACKAGES = ("sympy", "numba", "llvmlite", "numpy")
_EMITTERS = ("parts", "symbolic", "kernels")


def scene_fingerprint(scene: Scene) -> str:
    """Return text that is equal for two scenes exactly if the same generated code serves both."""
    rows = [environment()]
    rows += ["" if scene.spring is None else _part(scene.spring)]
    rows += [f"{barrier.side} {barrier.adhesive} {_part(barrier.law)}" for barrier in scene.barriers]
    rows += [_part(excitation) for excitation in scene.excitations]
    rows += ["" if scene.noise is None else _part(scene.noise)]
    rows += [entry.path for entry in scene.entries]
    return "\n".join(rows)


@functools.cache
def environment() -> str:
    """Versions of everything that writes or compiles code, and the source of this package's part of it."""
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
    return f"{structural} {declared} {_Walk().describe(type(part))}"


class _Walk:
    """One walk over everything that a formula may depend on, each thing once: into code, and by value for data.

    A thing that it cannot describe has another description in every process, so that no stale kernel is used.
    """

    def __init__(self) -> None:
        self._met: dict[int, tuple[int, Any]] = {}  # keeps what was met alive, so that no id is reused

    def describe(self, value: Any, names: tuple[str, ...] = ()) -> str:
        """Describe a value; of a module, only those members whose names are used."""
        if value is None or isinstance(value, bool | int | float | complex | str | bytes):
            return repr(value)
        if id(value) in self._met:
            return f"met {self._met[id(value)][0]}"
        self._met[id(value)] = len(self._met), value
        text = self._described(value, names)
        return text if len(text) < 100 else hashlib.sha256(text.encode()).hexdigest()

    def _described(self, value: Any, names: tuple[str, ...]) -> str:
        if isinstance(value, types.ModuleType | type | types.FunctionType | types.BuiltinFunctionType):
            return self._code_of(value, names)
        if isinstance(value, tuple | list):
            return f"({', '.join(self.describe(entry, names) for entry in value)})"
        if isinstance(value, set | frozenset):
            return f"{{{', '.join(sorted(self.describe(entry, names) for entry in value))}}}"
        if isinstance(value, dict):
            rows = (f"{self.describe(key, names)}: {self.describe(entry, names)}" for key, entry in value.items())
            return f"{{{', '.join(rows)}}}"
        for holder in ("fget", "__func__", "__wrapped__", "func"):  # property, static or bound, cached, partial
            if isinstance(inner := getattr(value, holder, None), types.FunctionType):
                rest = (getattr(value, "args", ()), getattr(value, "keywords", {}))
                return f"{type(value).__name__} {self.describe(inner)} {self.describe(rest)}"
        try:
            return f"{self.describe(type(value))} {hashlib.sha256(pickle.dumps(value, protocol=5)).hexdigest()}"
        except Exception:
            return f"{type(value)} {os.getpid()} {id(value)}"

    def _code_of(self, value: Any, names: tuple[str, ...]) -> str:
        module = value.__name__ if isinstance(value, types.ModuleType) else str(value.__module__)
        name = getattr(value, "__qualname__", "")
        if _is_versioned(module):
            return f"{module} {name}"
        if isinstance(value, types.ModuleType):
            used = sorted(set(names) & set(vars(value)))
            return f"{module} {[(name, self.describe(vars(value)[name], names)) for name in used]}"
        if isinstance(value, type):
            return f"{module} {name} {self._members(value)}"
        return self._function(value) if isinstance(value, types.FunctionType) else f"{module} {name}"

    def _members(self, cls: type) -> list[str]:
        rows = [self.describe(base) for base in cls.__bases__]
        for name, value in sorted(vars(cls).items()):
            if name != "_abc_impl" and not (name.startswith("__") and name.endswith("__")):
                rows.append(f"{name}={self.describe(value)}")
        return rows

    def _function(self, function: types.FunctionType) -> str:
        names = _names(function.__code__)
        rows = [self._code(function.__code__)]
        known = function.__globals__
        rows += [f"{name}={self.describe(known[name], names)}" for name in sorted(set(names) & set(known))]
        rows += [self.describe(cell.cell_contents, names) for cell in function.__closure__ or () if _filled(cell)]
        rows += [self.describe((function.__defaults__, function.__kwdefaults__))]
        return "\n".join(rows)

    def _code(self, code: types.CodeType) -> str:
        constants = [self._code(c) if inspect.iscode(c) else self.describe(c) for c in code.co_consts]
        return f"{code.co_code.hex()} {constants} {code.co_names} {code.co_varnames} {code.co_freevars}"


def _is_versioned(module: str) -> bool:
    """Whether the versions in `_environment` determine a module's code."""
    root = module.partition(".")[0]
    if root in sys.stdlib_module_names:  # a user's file may have such a name too
        place = getattr(sys.modules.get(root), "__file__", None)
        return place is None or Path(place).is_relative_to(Path(os.__file__).parent)
    return root in ("vibrokit", "mpmath", *_PACKAGES)


def _filled(cell: Any) -> bool:
    try:
        cell.cell_contents  # noqa: B018 - an empty cell raises
    except ValueError:
        return False
    return True


def _names(code: types.CodeType) -> tuple[str, ...]:
    inner = [name for constant in code.co_consts if inspect.iscode(constant) for name in _names(constant)]
    return (*code.co_names, *inner)
