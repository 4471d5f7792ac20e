"""Fingerprint of a scene: what decides its generated code, without parameter values. It tells which kernel fits.

A part of this package is told by its class and the values that shape its equations, so that a kernel from disk needs no
SymPy. Any other part is told by its formulas, called with the symbols of the model: whatever they are made of, a
formula that says something else is another one.
"""

from __future__ import annotations

import functools
import hashlib
import importlib.metadata
import sys
import uuid
from pathlib import Path
from typing import Any

from vibrokit.parts.contact import ContactLaw
from vibrokit.parts.part import Part
from vibrokit.parts.scene import Scene

_PACKAGES = ("sympy", "numba", "llvmlite", "numpy")
_EMITTERS = ("parts", "symbolic", "kernels")


def scene_fingerprint(scene: Scene) -> str:
    """Return text that is equal for two scenes exactly if the same generated code serves both."""
    rows = [environment(), *(entry.path for entry in scene.entries), f"{scene.own_frequency > 0}"]
    rows += [f"{path} {_part(path, part, scene)}" for path, part in scene.placed_parts() if isinstance(part, Part)]
    rows += [f"{barrier.side} {barrier.adhesive} {_limits(barrier.law)}" for barrier in scene.barriers]
    rows += [] if scene.noise is None else [f"{scene.noise.extra_states}"]
    return "\n".join(rows)


def emitter_fingerprint(emitter: Any) -> str:
    """Return text that names the code of a stepper, or of what else writes kernels."""
    kind: type = type(emitter)
    own = kind.__module__.startswith("vibrokit.")
    return f"{emitter.name} {kind.__module__}.{kind.__qualname__} {'' if own else _token(kind)}"


@functools.cache
def _token(kind: type) -> str:
    """A name that no other class has, in this process or another: nothing tells the code of a stepper of a user's."""
    return uuid.uuid4().hex


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


def _part(path: str, part: Part, scene: Scene) -> str:
    declared = [(d.name, d.symbol, d.minimum, d.above, d.structural) for d in part.declared()]
    structural = [(d.name, part.parameters[d.name]) for d in part.declared() if d.structural]
    if part.is_ours():
        return f"{structural} {declared} {type(part)}"
    from vibrokit.symbolic.formulas import formulas_of

    return f"{structural} {declared} {formulas_of(scene, path, part)}"


def _limits(law: ContactLaw) -> str:
    """What the limits of a law depend on besides its formula: the signs of its parameters, and where it vanishes."""
    numbers = [law.parameters[d.name] for d in law.declared() if not d.structural]
    return f"{[(number > 0) - (number < 0) for number in numbers]} {law.touch()}"
