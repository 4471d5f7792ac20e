"""Templates: the functions of steppers, as text that generated modules are pasted from.

A template uses names that it does not import: those of templates pasted above it, in the order of `Stepper.templates`,
and those of the constants above all, which `Stepper.driver_part` writes.
"""

from __future__ import annotations

import ast
import functools
import re
from collections.abc import Sequence
from pathlib import Path

_TEMPLATES = Path(__file__).parent / "templates"


@functools.cache
def read_template(name: str) -> str:
    """Read a template without its docstring."""
    text = (_TEMPLATES / f"{name}.py").read_text(encoding="utf-8")
    return "\n".join(text.split("\n")[ast.parse(text).body[0].end_lineno :])


@functools.lru_cache(maxsize=64)  # the drivers of many scenes are one text
def with_needed_imports(text: str) -> str:
    """Gather the imports of all pieces where the first stands; names that nothing uses are left out."""
    tree = ast.parse(text)
    nodes = [node for node in tree.body if isinstance(node, ast.Import | ast.ImportFrom)]
    used = _used(tree)
    lines = _without(text, nodes)
    for node in nodes:
        node.names = [alias for alias in node.names if (alias.asname or alias.name) in used]
    kept = dict.fromkeys(ast.unparse(node) for node in nodes if node.names)
    first = nodes[0].lineno - 1
    body = [*lines[:first], *kept, *lines[first:]]
    return re.sub(r"\n{4,}", "\n\n\n", "\n".join(line for line in body if line is not None))


def _used(tree: ast.Module) -> set[str]:
    return {node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)}


def _without(text: str, nodes: Sequence[ast.stmt]) -> list[str | None]:
    """The lines of a text; those of some statements are replaced by None."""
    lines: list[str | None] = list(text.split("\n"))
    for node in nodes:
        lines[node.lineno - 1 : node.end_lineno] = [None] * ((node.end_lineno or node.lineno) - node.lineno + 1)
    return lines
