"""Scene files in TOML. They may come from strangers, so they are read as data and never run as code."""

from __future__ import annotations

import copy
import inspect
import json
import math
import os
import tomllib
from collections.abc import Callable, Mapping
from numbers import Integral
from pathlib import Path
from typing import Any

from vibrokit.arguments import real
from vibrokit.construction import called
from vibrokit.errors import SceneError, UnknownNameError, VibrokitError, nearest, nearest_form, shown
from vibrokit.oscillator import Oscillator
from vibrokit.parts.barrier import Barrier
from vibrokit.parts.contact import ContactLaw
from vibrokit.parts.excitation import Excitation
from vibrokit.parts.own_numbers import NUMBERS
from vibrokit.parts.part import Part
from vibrokit.parts.scene import Scene
from vibrokit.parts.single_parts import SINGLE_PARTS
from vibrokit.quantity import Quantity
from vibrokit.registry import Group, load, name_of
from vibrokit.results.atomic import write_atomically

_BUNDLED = Path(__file__).parent / "scenes"
_LARGEST_FILE = 100_000
_MOST_PARTS = 100
_LONGEST_NAME = 100
_NUMBERS = tuple(declared.name for declared in NUMBERS)
_KEYS = ("mass", *_NUMBERS, "spring", "friction", "barriers", "excitations", "noise")
_GROUPS = {"spring": Group.SPRINGS, "friction": Group.FRICTIONS, "noise": Group.NOISE_MODELS}  # of `SINGLE_PARTS`
_GIVEN = "given"  # in records: what was given with a unit, as text by path, beside the numbers
_BARRIER_KEYS = ("law", "position", "side", "adhesive")


@called
def bundled_scenes() -> tuple[str, ...]:
    """Return the names of the bundled scenes."""
    return tuple(sorted(path.stem for path in _BUNDLED.glob("*.toml")))


@called
def load_scene(source: str | os.PathLike[str]) -> Oscillator:
    """Read a scene from a file, or a bundled scene by name.

    Parameters
    ----------
    source : str or path
        Path of a TOML file, or one of `bundled_scenes`.

    Returns
    -------
    Oscillator

    Raises
    ------
    SceneError, ParameterError
        The file does not describe a scene.
    UnknownNameError
        A part is not registered, or `source` is neither a file nor a bundled scene.
    """
    path = _find(source)
    data = _read(path)
    try:
        return scene_from_data(data)
    except VibrokitError as error:
        raise type(error)(f"{path.name}: {error}") from error


def _find(source: str | os.PathLike[str]) -> Path:
    if not isinstance(source, str | os.PathLike):
        raise SceneError(f"the scene must be the path of a TOML file or one of {_bundled()}, got {shown(source)}.")
    path = Path(source)
    if str(source) in bundled_scenes() and not os.path.isfile(path):
        return _BUNDLED / f"{source}.toml"
    if os.path.isdir(path):
        raise SceneError(f"{path} is a folder; give a TOML file or one of {_bundled()}.")
    if not os.path.exists(path):  # False too for text that cannot be the name of a file
        known = {name: name for name in bundled_scenes()}
        known |= {name: str(file) for file in _beside(path) for name in (file.stem, file.name)}
        wanted = path.stem if path.suffix.lower() == ".toml" else path.name
        raise UnknownNameError(f"there is no file or bundled scene {shown(str(source))}{nearest_form(wanted, known)}")
    return path


def _beside(path: Path) -> list[Path]:
    """The scene files in the folder of a path."""
    try:
        return list(path.parent.glob("*.toml"))
    except (OSError, ValueError):  # no path that the system knows
        return []


def _bundled() -> str:
    return ", ".join(bundled_scenes())


def _read(path: Path) -> dict[str, Any]:
    try:
        with path.open("rb") as file:
            content = file.read(_LARGEST_FILE + 1)
    except OSError as error:
        raise SceneError(f"{path} cannot be read ({error.strerror}); give a readable TOML file.") from error
    if len(content) > _LARGEST_FILE:
        raise SceneError(f"{path} is too large for a scene; at most {_LARGEST_FILE} bytes are allowed.")
    try:
        return tomllib.loads(content.decode("utf-8-sig"))  # editors on Windows may begin a file with a mark
    except UnicodeDecodeError as error:
        raise SceneError(f"{path} is not UTF-8 text (byte {error.start}); give a TOML file.") from error
    except RecursionError as error:
        raise SceneError(f"{path} is nested too deeply; give tables of numbers and text.") from error
    except ValueError as error:  # TOMLDecodeError, or an integer too long for Python
        raise SceneError(f"{path} is not valid TOML: {' '.join(str(error).split())}.") from error


@called
def save_scene(scene: Scene, path: str | os.PathLike[str]) -> None:
    """Write a scene to a TOML file. Writing is atomic.

    Raises
    ------
    SceneError
        The class of a part is not registered, so the file cannot name it.
    FileError
        The file cannot be written.
    """
    if not isinstance(scene, Scene):
        raise SceneError(f"save_scene: scene must be an Oscillator, got {shown(scene)}.")
    write_atomically(path, scene_text(scene).encode("utf-8"))


def scene_text(scene: Scene) -> str:
    """Return the TOML text of a scene file; raises SceneError if the class of a part is not registered."""
    data = _exchanging(_tables(scene), str)
    for kind, values in _named_parts(data):
        if ":" in values["name"]:
            raise SceneError(
                f"{values['name']} is not registered, so a scene file cannot name it; register the class under the "
                f"entry-point group {kind.value!r}."
            )
    return _toml(data)


def scene_data(scene: Scene) -> dict[str, Any]:
    """Return a scene as plain data: numbers in SI base units per unit mass, and beside them what was given with a unit.

    A class that is not registered is named module:Class.
    """
    given = {path: quantity.text for path, quantity in scene.quantities.items()}
    return _exchanging(_tables(scene), float) | ({_GIVEN: given} if given else {})


def _exchanging(data: Any, exchange: Callable[[Quantity], Any]) -> Any:
    """The tables of a scene with something else for each quantity."""
    if isinstance(data, dict):
        return {key: _exchanging(value, exchange) for key, value in data.items()}
    if isinstance(data, list):
        return [_exchanging(value, exchange) for value in data]
    return exchange(data) if isinstance(data, Quantity) else data


def _tables(scene: Scene) -> dict[str, Any]:
    """The tables of a scene file, with quantities."""
    data: dict[str, Any] = {entry.path: entry.value for entry in scene.given_numbers}
    data |= {} if scene.mass is None else {"mass": scene.mass}
    data |= {name: _part_data(_GROUPS[name], part) for name, part in scene.single_parts.items()}
    if scene.barriers:
        data["barriers"] = [_barrier_data(barrier) for barrier in scene.barriers]
    if scene.excitations:
        data["excitations"] = [_part_data(Group.EXCITATIONS, part) for part in scene.excitations]
    return {key: data[key] for key in _KEYS if key in data}


def _part_data(group: Group, part: Part) -> dict[str, Any]:
    return {"name": name_of(group, type(part)), **part.parameters}


def _barrier_data(barrier: Barrier) -> dict[str, Any]:
    data = {"law": _part_data(Group.CONTACT_LAWS, barrier.law), "position": barrier.position, "side": barrier.side}
    return data | ({"adhesive": True} if barrier.adhesive else {})


def _named_parts(data: Mapping[str, Any]) -> list[tuple[Group, dict[str, Any]]]:
    found = [(Group.CONTACT_LAWS, barrier["law"]) for barrier in data.get("barriers", ())]
    found += [(Group.EXCITATIONS, values) for values in data.get("excitations", ())]
    return found + [(group, data[name]) for name, group in _GROUPS.items() if name in data]


def scene_from_data(data: Mapping[str, Any]) -> Oscillator:
    """Return a checked oscillator from the tables of a scene file, or from the plain data of a record."""
    if _GIVEN in data:
        return _from_record(data)
    _check_keys("scene", data, _KEYS, required=())
    given = {name: data[name] for name in _GROUPS if data.get(name) is not None}
    return Oscillator(
        mass=data.get("mass"),
        **{name: data[name] for name in _NUMBERS if name in data},
        barriers=tuple(_barrier(f"barriers.{i}", b) for i, b in enumerate(_listed("barriers", data))),
        excitations=tuple(
            _part(f"excitations.{i}", Group.EXCITATIONS, Excitation, e)
            for i, e in enumerate(_listed("excitations", data))
        ),
        **{name: _part(name, _GROUPS[name], SINGLE_PARTS[name], values) for name, values in given.items()},
    )


def _from_record(data: Mapping[str, Any]) -> Oscillator:
    """The oscillator of plain data with texts of quantities beside its numbers, which must agree."""
    tables, given = copy.deepcopy({key: value for key, value in data.items() if key != _GIVEN}), data[_GIVEN]
    if not isinstance(given, Mapping):
        raise SceneError(f"scene: {_GIVEN} must be a table of texts by path, got {shown(given)}.")
    numbers = {path: _with_text(tables, path, text) for path, text in given.items()}
    osc = scene_from_data(tables)
    for path, quantity in osc.quantities.items():
        if path in numbers and not math.isclose(quantity, real(numbers[path]), rel_tol=1e-12):
            raise SceneError(f"scene: {path} is {shown(numbers[path])} and given as {shown(given[path])}; give one.")
    return osc


def _with_text(tables: Any, path: str, text: Any) -> Any:
    """Put a text in place of a number of some tables, and return the number."""
    *heads, last = path.split(".")
    try:
        for head in heads:
            tables = tables[int(head) if isinstance(tables, list) else head]
        number, tables[last] = tables[last], text
    except (LookupError, TypeError, ValueError):
        raise SceneError(f"scene: {shown(path)} is given as {shown(text)} and has no number.") from None
    return number


def _listed(key: str, data: Mapping[str, Any]) -> list[Any]:
    values = data.get(key, [])
    if not isinstance(values, list):
        raise SceneError(f"scene: {key} must be a list of tables [[{key}]], got {shown(values)}.")
    if len(values) > _MOST_PARTS:
        raise SceneError(f"scene: at most {_MOST_PARTS} entries of {key} are allowed, got {len(values)}.")
    return values


def _barrier(place: str, data: Any) -> Barrier:
    _check_keys(place, data, _BARRIER_KEYS, required=_BARRIER_KEYS[:3])
    law = _part(f"{place}.law", Group.CONTACT_LAWS, ContactLaw, data["law"])
    return _made(place, Barrier, law, data["position"], data["side"], data.get("adhesive", False))


def _part(place: str, group: Group, kind: type, data: Any) -> Any:
    if not isinstance(data, dict) or not isinstance(data.get("name"), str):
        raise SceneError(f"{place} must be a table with the name of the part and its parameters, got {shown(data)}.")
    if len(data["name"]) > _LONGEST_NAME:
        raise SceneError(f"{place}: name may have at most {_LONGEST_NAME} characters, got {shown(data['name'])}.")
    part: type = load(group, data["name"], kind)
    values = {key: value for key, value in data.items() if key != "name"}
    accepted = inspect.signature(part).parameters.values()
    open_ended = any(p.kind is p.VAR_KEYWORD for p in accepted)
    known = [p.name for p in accepted if p.kind is not p.VAR_KEYWORD]
    required = [p.name for p in accepted if p.default is p.empty and p.kind is not p.VAR_KEYWORD]
    _check_keys(f"{place} ({data['name']})", values, (*known, *values) if open_ended else known, required)
    return _made(place, part, **values)


def _made(place: str, make: Callable[..., Any], *arguments: Any, **values: Any) -> Any:
    """Make a part; prefix its errors with its place in the file."""
    try:
        return make(*arguments, **values)
    except VibrokitError as error:
        raise type(error)(f"{place}: {error}") from error


def _check_keys(place: str, data: Any, known: Any, required: Any) -> None:
    if not isinstance(data, Mapping):
        raise SceneError(f"{place} must be a table with {', '.join(known)}, got {shown(data)}.")
    for key in data:
        if key not in known:
            raise SceneError(f"{place} has an unknown entry {shown(key)}{nearest(key, known)}")
    for key in required:
        if key not in data:
            raise SceneError(f"{place} has no entry {key}; it needs {', '.join(required)}.")


def _toml(data: Mapping[str, Any]) -> str:
    rows = [f"{key} = {_value(value)}" for key, value in data.items() if isinstance(value, float | str)]
    for key, value in data.items():
        if isinstance(value, dict):
            rows += ["", f"[{key}]", *(f"{k} = {_value(v)}" for k, v in value.items())]
        elif isinstance(value, list):
            for table in value:
                rows += ["", f"[[{key}]]", *(f"{k} = {_value(v)}" for k, v in table.items())]
    return "\n".join([*rows, ""])


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_value(entry)}" for key, entry in value.items()) + " }"
    if isinstance(value, str):
        return json.dumps(value)  # a JSON string of printable text is a TOML basic string
    return repr(int(value)) if isinstance(value, Integral) else repr(float(value))
