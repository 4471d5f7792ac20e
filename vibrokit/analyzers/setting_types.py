"""Declared types of settings: which values they allow, and how a value typed on the command line is read."""

from __future__ import annotations

import contextlib
import dataclasses
import sys
import types
from collections.abc import Callable, Mapping, Sequence
from numbers import Integral, Real
from typing import Any, Literal, NamedTuple, Union, get_args, get_origin, get_type_hints

from vibrokit.errors import StructureError, counted, shown


class Typed(str):
    """The value of a setting as it was typed on the command line."""


class _Plain(NamedTuple):
    """A type whose values can be typed: its name for messages, its class, and how text is read."""

    name: str
    allowed: type
    read: Callable[[str], Any]


# In the order in which they are tried; text is read as the first that it fits.
_PLAIN: Mapping[Any, _Plain] = {
    type(None): _Plain("none", type(None), {"none": None}.__getitem__),
    bool: _Plain("true or false", bool, {"true": True, "false": False}.__getitem__),
    int: _Plain("a whole number", Integral, int),
    float: _Plain("a number", Real, float),
    str: _Plain("text", str, str),
}
_ANYTHING = bool | int | float | str | None
_SEQUENCES = (tuple, list, Sequence)


def checked(place: str, kind: type, field: dataclasses.Field[Any], value: Any) -> Any:
    """Return the value of a field of `kind`, read as its declared type if it was typed.

    Only types that can be typed are checked: numbers, text, true or false, none, and sequences and alternatives of
    these. `place` names the setting in the StructureError for other values.
    """
    declared = _declared_type(kind, field)
    found = _read(value, declared) if isinstance(value, Typed) else value
    if not _fits(found, declared):
        raise StructureError(f"{place} must be {_name(declared)}, got {shown(value)}.")
    return found


def _declared_type(kind: type, field: dataclasses.Field[Any]) -> Any:
    """The declared type of a field; Any if its name cannot be found, as one imported for type checkers only."""
    owner = [base for base in kind.__mro__ if vars(base).get("__dataclass_fields__", {}).get(field.name) is field][-1]
    alone = types.SimpleNamespace(__annotations__={field.name: field.type})
    module = sys.modules.get(owner.__module__, types.SimpleNamespace())
    try:
        return get_type_hints(alone, vars(module))[field.name]
    except Exception:  # whatever the annotation of a plug-in raises
        return Any


def _alternatives(declared: Any) -> tuple[Any, ...]:
    return get_args(declared) if get_origin(declared) in (Union, types.UnionType) else (declared,)


def _items(declared: Any, count: int) -> tuple[Any, ...]:
    """Types of the items of a sequence of `count` values."""
    arguments = get_args(declared)
    fixed = get_origin(declared) is tuple and Ellipsis not in arguments
    return arguments if fixed else arguments[:1] * count


def _read(text: str, declared: Any) -> Any:
    """Read text as the first alternative that it fits; as the type that it looks like if it fits none."""
    kinds = _alternatives(declared)
    for kind, plain in _PLAIN.items():
        if kind in kinds:
            with contextlib.suppress(ValueError, KeyError):
                return plain.read(text)
    words = [word.strip() for word in text.split(",")]
    for kind in kinds:
        items = _items(kind, len(words)) if get_origin(kind) in _SEQUENCES else ()
        if len(items) == len(words):
            return tuple(map(_read, words, items))
    if len(words) > 1:
        return tuple(_read(word, Any) for word in words)
    return _read(words[0], _ANYTHING)


def _fits(value: Any, declared: Any) -> bool:
    kinds = _alternatives(declared)
    if len(kinds) > 1:
        return any(_fits(value, kind) for kind in kinds)
    if declared in _PLAIN:
        return isinstance(value, _PLAIN[declared].allowed) and (declared is bool or not isinstance(value, bool))
    if get_origin(declared) is Literal:
        return value in get_args(declared)
    if get_origin(declared) not in _SEQUENCES:
        return True
    if isinstance(value, str) or not isinstance(value, Sequence):
        return False
    items = _items(declared, len(value))
    return len(items) == len(value) and all(map(_fits, value, items))


def _name(declared: Any) -> str:
    if declared in _PLAIN:
        return _PLAIN[declared].name
    arguments = get_args(declared)
    if get_origin(declared) is Literal:
        return " or ".join(map(repr, arguments))
    if get_origin(declared) not in _SEQUENCES:
        return " or ".join(map(_name, arguments))
    if get_origin(declared) is tuple and Ellipsis not in arguments:
        return f"{counted(len(arguments), 'value')} with commas between ({', '.join(map(_name, arguments))})"
    return f"{_name(arguments[0])}, or several with commas between"
