"""vibrokit list: all that is registered, by name, the parameters of each part and the fields of each exit."""

from __future__ import annotations

import argparse
import dataclasses
from collections.abc import Iterator

from vibrokit.analyzers.exits import Exit
from vibrokit.parts.formula_part import FormulaPart
from vibrokit.parts.parameter import Parameter
from vibrokit.parts.part import Part
from vibrokit.registry import Group, load_all, names
from vibrokit.scene_file import bundled_scenes
from vibrokit.testing import KINDS
from vibrokit.text_table import text_table

_KINDS: dict[Group, type[Part] | type[Exit]] = {checks.group: checks.kind for checks in KINDS}
_KINDS[Group.EXITS] = Exit


def list_names(options: argparse.Namespace) -> None:
    """Print all that is registered; of a part also its parameters, as ``name symbol [unit]``, of an exit its fields."""
    print("scenes:", ", ".join(bundled_scenes()))
    rows = {group: tuple(_rows(group)) for group in Group}
    lines = iter(text_table([row for of_group in rows.values() for row in of_group]))
    for group, of_group in rows.items():
        print(f"{group.noun}s:")
        for _ in of_group:
            print(f"    {next(lines)}")


def _rows(group: Group) -> Iterator[tuple[str, str, str]]:
    kind = _KINDS.get(group)
    working = {} if kind is None else load_all(group, kind)
    for name, distribution in names(group):
        if kind is not None and name not in working:
            yield name, distribution, "cannot be loaded"  # a warning gives the reason
        else:
            yield name, distribution, _described(working[name]) if kind is not None else ""


def _described(cls: type[Part] | type[Exit]) -> str:
    """The parameters of a part, or the fields of an exit in the order of its arguments."""
    if issubclass(cls, Exit):
        return ", ".join(field.name for field in dataclasses.fields(cls)) or "none"
    of_formula = ("formula", "constants") if issubclass(cls, FormulaPart) else ()
    shown = [_shown(declared) for declared in cls._declared if declared.attribute not in of_formula]
    if issubclass(cls, FormulaPart):
        shown.append(f"{cls.formula_name} in {' and '.join(cls.variables)} as text, and its constants")
    return ", ".join(shown) or "none"


def _shown(declared: Parameter) -> str:
    if declared.unit is None:
        return declared.name
    return f"{declared.name} {declared.symbol} [{declared.unit or '1'}]"
