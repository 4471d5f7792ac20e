"""Provenance in a file: scene, settings, findings, statistics and versions as JSON in one attribute."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from vibrokit.errors import ResultFileError, shown
from vibrokit.progress import Stats
from vibrokit.results.arrays import taken
from vibrokit.results.codes import Code
from vibrokit.results.finding import Finding

FORMAT = 3
"""Format of the files that this version writes and reads: a change after which a file no longer opens raises it."""

_NOT_FINITE = "float"  # {"float": "nan"} stands for a number that JSON does not have
_CODES = {code.value: code for code in Code}
_LONGEST_SEED = 1000  # digits; Python refuses to read more than a few thousand


def provenance_data(kind: str, names: Sequence[str], provenance: Mapping[str, Any]) -> dict[str, Any]:
    """Return kind and provenance as plain data; sentences of findings have `names` in them.

    `provenance` has the attributes of a record that `provenance_from` returns.
    """
    return {
        **provenance,
        "format": FORMAT,
        "kind": kind,
        "complete": bool(provenance["complete"]),
        "seed": None if provenance["seed"] is None else str(provenance["seed"]),
        "seconds": float(provenance["seconds"]),
        "stats": dataclasses.asdict(provenance["stats"]),
        "findings": findings_data(provenance["findings"], names),
    }


def json_text(value: Any) -> str:
    """Return plain data as JSON; raises ResultFileError for anything else."""
    try:
        return json.dumps(_plain(value), allow_nan=False, ensure_ascii=False)
    except (TypeError, ValueError, RecursionError) as error:
        raise ResultFileError(f"it holds something that is not plain data ({error})") from error


def json_data(text: Any) -> Any:
    """Return the data in a text that `json_text` made; raises ResultFileError."""
    try:
        return json.loads(text, object_hook=_number, parse_constant=_refused)
    except (TypeError, ValueError, RecursionError) as error:
        raise ResultFileError(f"it holds no JSON where some is needed ({type(error).__name__})") from error


def provenance_from(header: Any) -> dict[str, Any]:
    """Return the provenance as the attributes of a record have it; raises ResultFileError."""
    versions = taken(header, "versions", dict)
    return {
        "scene": _scene(header),
        "settings": taken(header, "settings", dict),
        "findings": findings_from(taken(header, "findings", list)),
        "stats": _stats(taken(header, "stats", dict)),
        "complete": taken(header, "complete", bool),
        "seed": _seed(header),
        "seconds": taken(header, "seconds", float),
        "versions": {name: taken(versions, name, str) for name in versions},
    }


def findings_data(findings: Sequence[Finding], names: Sequence[str] = ()) -> list[dict[str, Any]]:
    """Return findings as plain data. Each has its sentence too, for readers that do not know its code."""
    return [
        {
            "code": str(finding.code),
            "source": finding.source,
            "target": finding.target,
            "values": dict(finding.values),
            "sentence": finding.sentence(names),
        }
        for finding in findings
    ]


def findings_from(entries: Any) -> tuple[Finding, ...]:
    """Return the findings of plain data; those of unknown code become remarks. Raises ResultFileError."""
    if not isinstance(entries, list):
        raise ResultFileError(f"its findings are {shown(entries)}, and a list is needed")
    return tuple(_finding(entry) for entry in entries)


def _finding(entry: Any) -> Finding:
    word = taken(entry, "code", str)
    source, target = (None if entry.get(key) is None else taken(entry, key, int) for key in ("source", "target"))
    if word not in _CODES:
        return Finding.of(Code.REMARK, source, target, text=taken(entry, "sentence", str))
    values = taken(entry, "values", dict)
    for name, value in values.items():
        entries = value if isinstance(value, list) else [value]
        if not all(one is None or isinstance(one, float | int | str) for one in entries):
            raise ResultFileError(f"its finding {word!r} has {name} = {shown(value)}, and a number or text is needed")
    try:
        return Finding(_CODES[word], source, target, values)
    except TypeError as error:
        raise ResultFileError(f"its {error}") from error


def _stats(table: dict[str, Any]) -> Stats:
    names = [field.name for field in dataclasses.fields(Stats) if field.name != "seconds"]
    counts = {name: taken(table, name, int) for name in names}
    seconds = taken(table, "seconds", dict)
    return Stats(**counts, seconds={name: taken(seconds, name, float) for name in seconds})


def _seed(header: Any) -> int | None:
    """The seed, which is kept as text because it may be longer than numbers of JSON in other programs."""
    if isinstance(header, dict) and header.get("seed", "") is None:
        return None
    text = taken(header, "seed", str)
    if not (text.isascii() and text.isdigit() and len(text) < _LONGEST_SEED):
        raise ResultFileError(f"its provenance has seed = {shown(text)}, and a whole number is needed")
    return int(text)


def _scene(header: Any) -> dict[str, Any]:
    """The scene; its stops are checked, because pictures show them."""
    scene = taken(header, "scene", dict)
    for barrier in taken(scene, "barriers", list) if "barriers" in scene else ():
        taken(barrier, "position", float)
        if taken(barrier, "side", str) not in ("left", "right"):
            raise ResultFileError(f"its scene has a stop on side {shown(barrier['side'])}; left or right is needed")
    return scene


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    if isinstance(value, np.generic):
        return _plain(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return {_NOT_FINITE: str(value)}
    return value


def _number(table: dict[str, Any]) -> Any:
    value = table.get(_NOT_FINITE)
    return float(value) if len(table) == 1 and value in ("nan", "inf", "-inf") else table


def _refused(word: str) -> Any:
    raise ValueError(f"{word} is no number of JSON")
