"""Settings of analyzers as text, as the command line has them."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

from vibrokit.analyzers.analyzer import Analyzer
from vibrokit.errors import SceneError, UnknownNameError, nearest

_NOTHING = "none"


def setting(text: str) -> tuple[str, Any]:
    """Read a setting from its text: ``points=40000``, ``graph.cells=240,240``, ``plot=none``.

    Raises
    ------
    SceneError
        It is not a name and a number, or numbers.
    """
    name, _, value = text.partition("=")
    try:
        numbers = tuple(_number(word) for word in value.split(",")) if value != _NOTHING else (None,)
    except ValueError:
        raise SceneError(
            f"setting {text!r}: write FIELD=NUMBER, such as points=40000, FIELD=NUMBER,NUMBER, such as "
            "graph.cells=240,240, or FIELD=none."
        ) from None
    return name, numbers[0] if len(numbers) == 1 else numbers


def _number(word: str) -> int | float:
    return int(word) if word.strip().lstrip("+-").isdecimal() else float(word)


def configured(kind: type[Analyzer], settings: Mapping[str, Any]) -> Analyzer:
    """Make an analyzer of some settings; one with a dot is a setting of a part of it.

    Raises
    ------
    UnknownNameError
        The analyzer, or the part, has no such setting.
    StructureError
        A setting has a value that it may not have.
    """
    own = {name: value for name, value in settings.items() if "." not in name}
    plain = kind()
    for name in own:
        if name not in _fields(plain):
            raise UnknownNameError(f"{kind.__name__} has no setting {name!r}{_where(plain, name)}")
    analyzer = kind(**own)
    for name, value in settings.items():
        part, dot, inner = name.partition(".")
        if dot:
            analyzer = dataclasses.replace(analyzer, **{part: _changed(analyzer, part, inner, value)})
    return analyzer


def _changed(analyzer: Analyzer, part: str, inner: str, value: Any) -> Any:
    """A part of an analyzer with one setting changed."""
    parts = _parts(analyzer)
    if part not in parts:
        raise UnknownNameError(f"{type(analyzer).__name__} has no part {part!r}{nearest(part, parts)}")
    known = _fields(parts[part])
    if inner not in known:
        raise UnknownNameError(f"{type(parts[part]).__name__} has no setting {inner!r}{nearest(inner, known)}")
    return dataclasses.replace(parts[part], **{inner: value})


def _fields(configuration: Any) -> list[str]:
    return [field.name for field in dataclasses.fields(configuration)]


def _parts(analyzer: Analyzer) -> dict[str, Any]:
    """Settings that have settings of their own."""
    values = {name: getattr(analyzer, name) for name in _fields(analyzer)}
    return {name: value for name, value in values.items() if dataclasses.is_dataclass(value) and _fields(value)}


def _where(analyzer: Analyzer, name: str) -> str:
    """The end of a sentence that says which part has a setting, or which setting has the nearest name."""
    homes = [f"{part}.{name}" for part, value in _parts(analyzer).items() if name in _fields(value)]
    return f"; write {' or '.join(homes)}." if homes else nearest(name, _fields(analyzer))
