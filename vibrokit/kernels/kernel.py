"""Kernel: the compiled code of one flow of one scene, for one stepper."""

from __future__ import annotations

import ast
import contextlib
import dataclasses
import functools
import hashlib
import re
import types
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import SceneError, StepperError, shown
from vibrokit.kernels import store
from vibrokit.kernels.fingerprint import scene_fingerprint
from vibrokit.kernels.stepper import Emitter
from vibrokit.parts.scene import Scene
from vibrokit.progress import compiling
from vibrokit.symbolic.flow_kind import Flow

_TEMPLATES = Path(__file__).parent / "templates"
_MARKER = "# --- scene above, stepper below ---\n"
_NEED_NOISE = {
    Flow.NOISY: "random forces",
    Flow.LINEARISED: "random forces",
    Flow.COVARIANCE_REVERSED: "random forces",
    Flow.HAMILTONIAN: "momenta",
    Flow.HAMILTONIAN_VARIATIONAL: "momenta",
}
_CONDITION = re.compile(r"  # (\w+)\n$")  # a comment of one word at the end of a line of code


@dataclasses.dataclass(frozen=True)
class Kernel:
    """Generated source and the module compiled from it. Travels to other processes as text."""

    name: str  # of the module, made of what decides its code
    source: str

    @property
    def module(self) -> types.ModuleType:
        """The module, imported on first use; its functions compile when they are first called."""
        return store.load(self.name, self.source)


def kernel_for(scene: Scene, flow: Flow, stepper: Emitter) -> Kernel:
    """Return the kernel for a flow of a scene: read from disk if one with the same code exists, else derived.

    Raises SceneError if the flow is one of noise or of momenta and the scene has no noise, and StepperError if the
    stepper cannot integrate this flow of this scene.
    """
    if scene.noise is None and flow in _NEED_NOISE:
        raise SceneError(
            f"scene: it has no noise, so there are no {_NEED_NOISE[flow]} and no {flow.value} flow; give the scene a "
            "noise model, such as WhiteNoise(intensity=2e-5)."
        )
    if not isinstance(stepper, Emitter):
        raise StepperError(f"stepper must be a Stepper, such as RK4(steps=256), got {shown(stepper)}.")
    stepper.check(scene, flow)
    return _kernel(scene_fingerprint(scene), flow, stepper.name, _Sources(scene, flow, stepper))


@dataclasses.dataclass(frozen=True, eq=False)
class _Sources:
    """What a kernel is derived from; never part of the key, which the fingerprint is."""

    scene: Scene
    flow: Flow
    stepper: Emitter

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Sources)

    def __hash__(self) -> int:
        return 0


@functools.lru_cache(maxsize=256)
def _kernel(fingerprint: str, flow: Flow, stepper: str, sources: _Sources) -> Kernel:
    digest = hashlib.sha256(f"{fingerprint}\n{flow.value}\n{stepper}".encode()).hexdigest()[:24]
    name = f"vibrokit_{flow.value}_{stepper}_{digest}"
    source = store.stored(name)
    if source is None:
        with compiling():
            source = write_source(sources.scene, flow, sources.stepper)
        store.store(name, source)
    return Kernel(name, source)


def first_call(function: Any) -> contextlib.AbstractContextManager[None]:
    """Return a context for a call of a compiled function that marks its first call in this process as compilation."""
    return contextlib.nullcontext() if function.overloads else compiling()


def write_source(scene: Scene, flow: Flow, stepper: Emitter) -> str:
    """Derive the equations and write the module, scene above and stepper below."""
    from vibrokit.symbolic.source import SceneText  # only here is SymPy needed

    text = SceneText(scene, flow)
    templates = [read_template(name) for name in stepper.templates_for(text)]
    imports = "\n".join(dict.fromkeys(line for template in templates for line in template.imports))
    body = "\n\n".join(template.body.strip("\n") + "\n" for template in templates)
    bends = text.breaks and flow is Flow.HAMILTONIAN_VARIATIONAL
    conditions = {"forced": text.forced, "unforced": not text.forced, "noisy": flow is Flow.NOISY}
    conditions |= {"breaking": text.breaks, "unbroken": not text.breaks, "bending": bends, "unbent": not bends}
    conditions |= {"staged": stepper.staged, "scaled": stepper.scaled}
    pieces = [text.preamble, imports, *stepper.scene_part(text), _fitting(body, conditions)]
    return _with_needed_imports("\n\n".join(piece.strip("\n") + "\n" for piece in pieces if piece))


def _with_needed_imports(text: str) -> str:
    """Gather the imports of all pieces where the first stands; names that nothing uses are left out."""
    tree = ast.parse(text)
    nodes = [node for node in tree.body if isinstance(node, ast.Import | ast.ImportFrom)]
    used = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
    lines: list[str | None] = list(text.split("\n"))
    for node in nodes:
        lines[node.lineno - 1 : node.end_lineno] = [None] * ((node.end_lineno or node.lineno) - node.lineno + 1)
        node.names = [alias for alias in node.names if (alias.asname or alias.name) in used]
    kept = dict.fromkeys(ast.unparse(node) for node in nodes if node.names)
    first = nodes[0].lineno - 1
    body = [*lines[:first], *kept, *lines[first:]]
    return re.sub(r"\n{4,}", "\n\n\n", "\n".join(line for line in body if line is not None))


class Template(NamedTuple):
    """A stepper's text: its imports, and its functions."""

    imports: tuple[str, ...]
    body: str


def read_template(name: str) -> Template:
    """Read a template; what it imports from the sample scene is left out, for the real scene provides it."""
    head, body = (_TEMPLATES / f"{name}.py").read_text(encoding="utf-8").split(_MARKER, 1)
    imports = [node for node in ast.parse(head).body if isinstance(node, ast.Import | ast.ImportFrom)]
    kept = [node for node in imports if ".templates" not in (getattr(node, "module", None) or "")]
    return Template(tuple(ast.unparse(node) for node in kept), body)


def _fitting(text: str, conditions: dict[str, bool]) -> str:
    """Keep the lines of a template whose condition holds, so that a scene has no trace of what it lacks."""
    kept = []
    for line in text.splitlines(keepends=True):
        condition = _CONDITION.search(line)
        if condition is None:
            kept.append(line)
        elif condition[1] not in conditions:
            raise ValueError(f"the line {line.strip()!r} of a template has an unknown condition.")
        elif conditions[condition[1]]:
            kept.append(line[: condition.start()] + "\n")
    return "".join(kept)


def theta_of(scene: Scene) -> NDArray[np.float64]:
    """Return the parameters of a scene in the order in which kernels read them."""
    return np.array([entry.value for entry in scene.entries if not entry.declared.structural], dtype=float)
