"""Fingerprint of a scene: the code of its parts, without parameter values. It decides which compiled kernel fits.

It is computed from bytecode, so that it works for classes typed at a prompt and needs no SymPy.
"""

from __future__ import annotations

import contextlib
import dis
import functools
import hashlib
import importlib
import importlib.metadata
import inspect
import os
import sys
import types
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from vibrokit.parts.contact import ContactLaw
from vibrokit.parts.scene import Scene

_PACKAGES = ("sympy", "numba", "llvmlite", "numpy")
_EMITTERS = ("parts", "symbolic", "kernels")
_OF_EVERY_CLASS = (  # what decides no code, or what functions that are described were made of
    "_abc_impl", "__abstractmethods__", "__annotate__", "__annotate_func__", "__annotations__", "__annotations_cache__",
    "__dataclass_fields__", "__dataclass_params__", "__dict__", "__doc__", "__firstlineno__", "__match_args__",
    "__module__", "__parameters__", "__static_attributes__", "__weakref__",
)  # fmt: skip
_UNDESCRIBED: dict[int, Any] = {}  # keeps them alive, so that no id is reused


def scene_fingerprint(scene: Scene) -> str:
    """Return text that is equal for two scenes exactly if the same generated code serves both."""
    rows = [environment()]
    rows += ["" if scene.spring is None else _part(scene.spring)]
    rows += [
        f"{barrier.side} {barrier.adhesive} {_part(barrier.law)} {_limits(barrier.law)}" for barrier in scene.barriers
    ]
    rows += [_part(excitation) for excitation in scene.excitations]
    rows += ["" if scene.noise is None else f"{scene.noise.extra_states} {_part(scene.noise)}"]
    rows += [entry.path for entry in scene.entries]
    return "\n".join(rows)


def emitter_fingerprint(emitter: Any) -> str:
    """Return text that names the code of a stepper, or of what else writes kernels."""
    return f"{emitter.name} {_Walk().describe(type(emitter))}"


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


def _limits(law: ContactLaw) -> str:
    """What the limits of a law depend on besides its formula: the signs of its parameters, and where it vanishes."""
    numbers = [law.parameters[d.name] for d in law.declared() if not d.structural]
    return f"{[(number > 0) - (number < 0) for number in numbers]} {law.touch()}"


class _Walk:
    """One walk over everything that a formula may depend on, each thing once: into code, and by value for data.

    A thing that it cannot describe has another description in every process, so that no stale kernel is used.
    """

    def __init__(self) -> None:
        self._met: dict[int, tuple[int, Any]] = {}  # keeps what was met alive, so that no id is reused

    def describe(self, value: Any, names: tuple[str, ...] = ()) -> str:
        """Describe a value; of a module, only those members whose names are used."""
        if value is None or value is ... or type(value) in (bool, int, float, complex, str, bytes):
            return repr(value)
        if id(value) in self._met:
            return f"met {self._met[id(value)][0]}"
        self._met[id(value)] = len(self._met), value
        text = self._described(value, names)
        return text if len(text) < 100 else hashlib.sha256(text.encode()).hexdigest()

    def _described(self, value: Any, names: tuple[str, ...]) -> str:
        if isinstance(value, types.ModuleType | type | types.FunctionType | types.BuiltinFunctionType):
            return self._code_of(value, names)
        if type(value) in (tuple, list):
            return f"({', '.join(self.describe(entry, names) for entry in value)})"
        if type(value) in (set, frozenset):
            return f"{{{', '.join(sorted(self.describe(entry, names) for entry in value))}}}"
        if type(value) is dict:
            rows = (f"{self.describe(key, names)}: {self.describe(entry, names)}" for key, entry in value.items())
            return f"{{{', '.join(rows)}}}"
        if isinstance(value, property):
            return f"property {self.describe((value.fget, value.fset))}"
        for holder in ("__func__", "__wrapped__", "func"):  # static or bound, cached, partial
            if isinstance(inner := getattr(value, holder, None), types.FunctionType):
                rest = [getattr(value, name, None) for name in ("args", "keywords", "__self__")]
                return f"{type(value).__name__} {self.describe(inner)} {self.describe(rest)}"
        return self._state(value)

    def _state(self, value: Any) -> str:
        """Describe an object by what makes a copy of it: its class, arguments and state."""
        try:
            recipe = value.__reduce_ex__(4)
        except Exception:
            _UNDESCRIBED[id(value)] = value
            return f"{type(value)} {os.getpid()} {id(value)}"
        made = recipe if isinstance(recipe, str) else [list(p) if isinstance(p, Iterator) else p for p in recipe]
        return f"{self.describe(type(value))} {self.describe(made)}"

    def _code_of(self, value: Any, names: tuple[str, ...]) -> str:
        module = value.__name__ if isinstance(value, types.ModuleType) else str(value.__module__)
        name = getattr(value, "__qualname__", "")
        if _is_versioned(module) and _is_member(value, module, name):
            return f"{module} {name}"
        if isinstance(value, types.ModuleType):
            used = sorted(set(names) & set(vars(value)))
            return f"{module} {[(name, self.describe(vars(value)[name], names)) for name in used]}"
        if isinstance(value, type):
            return f"{module} {name} {self._members(value)}"
        if isinstance(value, types.FunctionType):
            return self._function(value, versioned=_is_versioned(module) and _in_package(value, module))
        owner = value.__self__
        return f"{module} {name} {'' if isinstance(owner, types.ModuleType) else self.describe(owner)}"

    def _members(self, cls: type) -> list[str]:
        rows = [self.describe(base) for base in (type(cls), *cls.__bases__)]
        for name, value in sorted(vars(cls).items()):
            if name not in _OF_EVERY_CLASS:
                rows.append(f"{name}={self.describe(value)}")
        return rows

    def _function(self, function: types.FunctionType, versioned: bool) -> str:
        """Describe a function; of one whose code the environment determines, what it encloses."""
        names = _names(function.__code__)
        rows = [function.__qualname__ if versioned else self._code(function.__code__)]
        if not versioned:
            known = function.__globals__
            rows += [f"{name}={self.describe(known[name], names)}" for name in sorted(set(names) & set(known))]
            rows += [self.describe(module, names) for module in _imported(function)]
        rows += [self.describe(cell.cell_contents, names) for cell in function.__closure__ or () if _filled(cell)]
        rows += [self.describe((function.__defaults__, function.__kwdefaults__, vars(function)))]
        return "\n".join(rows)

    def _code(self, code: types.CodeType) -> str:
        constants = [self._code(c) if inspect.iscode(c) else self.describe(c) for c in code.co_consts]
        return f"{code.co_code.hex()} {constants} {code.co_names} {code.co_varnames} {code.co_freevars}"


def _is_versioned(module: str) -> bool:
    """Whether the versions in `_environment` determine a module's code."""
    root = module.partition(".")[0]
    if root in sys.stdlib_module_names:  # a user's file may have such a name too
        place = getattr(sys.modules.get(root), "__file__", None)
        return root != "__main__" and (place is None or Path(place).is_relative_to(Path(os.__file__).parent))
    return root in ("vibrokit", "mpmath", *_PACKAGES)


def _is_member(value: Any, module: str, name: str) -> bool:
    """Whether a module has a thing at its name: what `exec` makes claims any module, ``builtins`` by default."""
    if isinstance(value, types.ModuleType):
        return sys.modules.get(module) is value
    found: Any = sys.modules.get(module)
    for part in name.split("."):
        found = getattr(found, "__dict__", {}).get(part)
    return getattr(found, "__func__", found) is value


def _in_package(function: types.FunctionType, module: str) -> bool:
    """Whether the code of a function stands in the files of the package that it claims."""
    place = getattr(sys.modules.get(module.partition(".")[0]), "__file__", None)
    return place is not None and Path(function.__code__.co_filename).is_relative_to(Path(place).parent)


def _imported(function: types.FunctionType) -> list[types.ModuleType]:
    """Modules that a function imports itself, without those that the environment describes."""
    package, modules = function.__globals__.get("__package__"), []
    for name, members in _imports(function.__code__):
        if name.startswith(".") or not _is_versioned(name):
            with contextlib.suppress(ImportError):  # the formula meets the same error, and has the words for it
                module = importlib.import_module(name, package)
                modules.append(module)
                for member in {*members} - {*vars(module)}:
                    importlib.import_module(f"{module.__name__}.{member}")
    return modules


@functools.cache
def _imports(code: types.CodeType) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """Names of the modules that code imports, with a dot for each level of a relative import, and what of them."""
    found, steps = [], list(dis.get_instructions(code))
    for level, members, step in zip(steps, steps[1:], steps[2:], strict=False):
        if step.opname == "IMPORT_NAME":
            found.append(("." * int(level.argval) + str(step.argval), members.argval or ()))
    inner = [name for constant in code.co_consts if inspect.iscode(constant) for name in _imports(constant)]
    return (*found, *inner)


def _filled(cell: Any) -> bool:
    try:
        cell.cell_contents  # noqa: B018 - an empty cell raises
    except ValueError:
        return False
    return True


def _names(code: types.CodeType) -> tuple[str, ...]:
    inner = [name for constant in code.co_consts if inspect.iscode(constant) for name in _names(constant)]
    return (*code.co_names, *inner)
