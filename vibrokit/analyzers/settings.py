"""Settings of analyzers: as plain data that files carry, and as text on the command line."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from vibrokit.analyzers.exits import Exit
from vibrokit.analyzers.setting_types import Typed, checked
from vibrokit.errors import SceneError, StructureError, UnknownNameError, VibrokitError, counted, nearest, shown
from vibrokit.kernels.named import name_of as stepper_name
from vibrokit.kernels.named import named_stepper
from vibrokit.kernels.stepper import Stepper
from vibrokit.registry import Group, load, name_of

if TYPE_CHECKING:
    from vibrokit.analyzers.analyzer import Analyzer


def settings_of(analyzer: Analyzer) -> dict[str, Any]:
    """Return the configuration of an analyzer as plain data, from which `analyzer_from` builds it again."""
    return {"analyzer": name_of(Group.ANALYZERS, type(analyzer)), **_fields_as_data(analyzer)}


def _fields_as_data(configuration: Any) -> dict[str, Any]:
    return {field.name: _as_data(getattr(configuration, field.name)) for field in dataclasses.fields(configuration)}


def _as_data(value: Any) -> Any:
    if isinstance(value, Stepper):
        return stepper_name(value)
    if isinstance(value, Exit):
        return exit_data(value)
    if dataclasses.is_dataclass(value):
        return _fields_as_data(value)
    return list(value) if isinstance(value, tuple) else value


def exit_data(one: Exit) -> dict[str, Any]:
    """Return an exit as plain data, as `settings_of` has it."""
    return {"name": name_of(Group.EXITS, type(one)), **_fields_as_data(one)}


def analyzer_from(settings: Mapping[str, Any]) -> Analyzer:
    """Build the analyzer whose settings a result carries.

    Raises
    ------
    UnknownNameError
        The analyzer or its exit is not registered, or has no such setting.
    StructureError
        A setting has a value that is not allowed.
    """
    from vibrokit.analyzers.analyzer import Analyzer

    kind = load(Group.ANALYZERS, str(settings.get("analyzer")), Analyzer)
    return configured(kind, {name: value for name, value in settings.items() if name != "analyzer"})


def configured(kind: type[Analyzer], settings: Mapping[str, Any]) -> Analyzer:
    """Make an analyzer from settings; ``graph.nodes`` is the setting ``nodes`` of its part ``graph``.

    Raises
    ------
    UnknownNameError
        The analyzer, or the part, has no such setting.
    StructureError
        A setting has a value that is not allowed.
    """
    nested: dict[str, Any] = {}
    for name, value in settings.items():
        part, dot, inner = name.partition(".")
        if not dot:
            nested[name] = value
        elif isinstance(nested.setdefault(part, {}), dict):
            nested[part][inner] = value
    return _made(kind, nested, f"{kind.__name__}: ")


def _made(kind: type, settings: Mapping[str, Any], place: str) -> Any:
    """Make an analyzer, a part of it or an exit; `place` names it before its settings in messages."""
    fields = {field.name: field for field in dataclasses.fields(kind)}
    for name in settings:
        if name not in fields:
            raise UnknownNameError(f"{kind.__name__} has no setting {name!r}{_where(fields, name)}")
    values = {name: _read(kind, fields[name], value, f"{place}{name}") for name, value in settings.items()}
    try:
        return kind(**values)
    except VibrokitError:
        raise
    except ValueError as error:  # the way in which Python's own classes refuse a value
        raise StructureError(f"{kind.__name__}: {error}") from error


def _read(kind: type, field: dataclasses.Field[Any], value: Any, place: str) -> Any:
    if field.name == "exit" and isinstance(value, dict):
        exit_kind = load(Group.EXITS, str(value.get("name")), Exit)
        return _made(exit_kind, {name: entry for name, entry in value.items() if name != "name"}, f"{place}.")
    if isinstance(value, str) and value != "none":
        if field.name == "exit":
            return named_exit(value)
        if field.name == "stepper":
            return named_stepper(value)
    if isinstance(value, dict):
        part = _part_of(field)
        if part is None:
            raise UnknownNameError(f"{kind.__name__} has no part {field.name!r} with settings of its own.")
        return _made(part, value, f"{place}.")
    return checked(place, kind, field, tuple(value) if isinstance(value, list) else value)


def _part_of(field: dataclasses.Field[Any]) -> type | None:
    """The class of a setting that has settings itself, as its default shows."""
    default = None if field.default_factory is dataclasses.MISSING else field.default_factory()
    return type(default) if dataclasses.is_dataclass(default) and dataclasses.fields(default) else None


def _where(fields: Mapping[str, dataclasses.Field[Any]], name: str) -> str:
    """The end of a sentence that names the part that has a setting, or the setting of the nearest name."""
    parts = {own: part for own, field in fields.items() if (part := _part_of(field)) is not None}
    homes = [f"{own}.{name}" for own, part in parts.items() if name in [f.name for f in dataclasses.fields(part)]]
    return f"; write {' or '.join(homes)}." if homes else nearest(name, fields)


def setting(text: str) -> tuple[str, Typed]:
    """Split a setting from the command line, such as ``points=40000``, ``graph.nodes=240,240`` or ``graph=none``.

    Raises
    ------
    SceneError
        It has no name or no value.
    """
    name, equals, value = text.partition("=")
    if not (name and equals and value):
        raise SceneError(
            f"setting {text!r}: write FIELD=VALUE, such as points=40000, graph.nodes=240,240, source=clear or "
            "graph=none."
        )
    return name, Typed(value)


def named_exit(text: str) -> Exit:
    """Read an exit from its registered name and its arguments: ``leave-basin``, ``first-contact:right``.

    Raises
    ------
    UnknownNameError
        No such exit is registered.
    StructureError
        The exit does not take these arguments.
    """
    name, colon, arguments = text.partition(":")
    kind = load(Group.EXITS, name, Exit)
    fields = dataclasses.fields(kind)
    values = [Typed(word) for word in arguments.split(",")] if colon else []
    if len(values) > len(fields):
        raise StructureError(f"exit {shown(text)}: {name} takes {counted(len(fields), 'argument')}, got {len(values)}.")
    return _made(kind, {field.name: value for field, value in zip(fields, values, strict=False)}, f"{kind.__name__}: ")
