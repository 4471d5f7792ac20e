"""documented: a dataclass describes each attribute where it declares it."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Mapping
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

T = TypeVar("T")

_WIDTH = 112  # of a docstring's lines
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def documented(kind: type[T]) -> type[T]:
    """Describe the attributes of a dataclass in its docstring, as its own annotations declare them.

    ``Annotated[float, "time after which it repeats; 0 at rest", "s"]`` has a text and a unit. In place of the text may
    be an object with a `long_name`, `units` and a `noun` for the type, as of `vibrokit.results.fields`.
    """
    own = vars(kind).get("__annotations__", {})
    if not any("Annotated" in str(one) for one in own.values()):
        return kind
    plain, lines = get_type_hints(kind), []
    for name, hint in get_type_hints(kind, include_extras=True).items():
        said = getattr(hint, "__metadata__", ()) if name in own else ()
        if said and isinstance(said[0], str):
            lines += _entry(name, _noun(plain[name]), *said)
        elif said:
            lines += _entry(name, said[0].noun or _noun(plain[name]), said[0].long_name, said[0].units)
    kind.__doc__ = "\n".join([(kind.__doc__ or "").rstrip(), "", "    Attributes", "    ----------", *lines])
    signature = kind.__init__.__annotations__  # it shows types alone
    signature |= {name: hint for name, hint in plain.items() if name in signature}
    return kind


def _entry(name: str, noun: str, text: str, units: str = "") -> list[str]:
    raised = re.sub(r"(?<=[a-z])-?\d", lambda power: power[0].translate(_RAISED), units)
    first, semicolon, rest = text.partition(";")
    first = first if first.startswith("ln ") else f"{first[:1].upper()}{first[1:]}"
    words = f"{first}{f' ({raised})' if units not in ('', '1') else ''}{semicolon}{rest}."
    return [f"    {name} : {noun}", textwrap.indent(textwrap.fill(words, _WIDTH), " " * 8)]


def _noun(kind: Any) -> str:
    """A type in words: ``"tuple of Survival"``, ``"ExitPath or None"``."""
    origin = get_origin(kind)
    if origin is tuple:
        return f"tuple of {_noun(get_args(kind)[0])}"
    if origin is Mapping:
        return "mapping"
    if getattr(origin, "__name__", "") == "ndarray":
        return "array"
    if "_array_like" in repr(kind):  # NumPy's union of what it takes for an array
        return "array_like"
    return " or ".join(map(_noun, get_args(kind))) or kind.__name__.removesuffix("Type")
