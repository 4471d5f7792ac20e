"""Records inside a record: their arrays beside one another in one dataset, each with a prefix, and their provenance."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import xarray

from vibrokit.errors import ResultFileError, UnknownNameError, shown
from vibrokit.registry import Group, load
from vibrokit.results.arrays import taken
from vibrokit.results.plain import PlainRecord
from vibrokit.results.provenance import json_data, json_text, provenance_from, provenance_text
from vibrokit.results.record import Record

_CONTENTS = "records"  # attribute: names of the records, in the order of their prefixes


def nested(records: Mapping[str, Record]) -> xarray.Dataset:
    """Return the arrays of several records, by name, as one dataset; raises ResultFileError."""
    whole = xarray.Dataset(attrs={_CONTENTS: json_text(list(records))})
    for number, record in enumerate(records.values()):
        own = record.to_dataset()
        if own.attrs:
            raise ResultFileError(f"a {type(record).__name__} with attributes of its own cannot be part of a record")
        prefixed = own.rename({name: f"{_prefix(number)}{name}" for name in {*own.variables, *own.dims}})
        whole = whole.assign(prefixed.data_vars).assign_coords(prefixed.coords)
        whole.attrs[f"{_prefix(number)}provenance"] = provenance_text(record)
    return whole


def records_in(dataset: xarray.Dataset) -> dict[str, Record]:
    """Return the records that `nested` put together; raises ResultFileError."""
    names = json_data(dataset.attrs.get(_CONTENTS))
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise ResultFileError(f"its records are {shown(names)}, and a list of names is needed")
    found = {}
    for number, name in enumerate(names):
        prefix = _prefix(number)
        own = dataset[[one for one in dataset.variables if str(one).startswith(prefix)]]
        own = own.rename({one: str(one).removeprefix(prefix) for one in {*own.variables, *own.dims}})
        own.attrs = {}
        header = json_data(dataset.attrs.get(f"{prefix}provenance"))
        found[name] = _record(taken(header, "kind", str), own, provenance_from(header))
    return found


def _record(kind: str, arrays: xarray.Dataset, provenance: Mapping[str, Any]) -> Record:
    try:
        return load(Group.RECORDS, kind, Record).from_dataset(arrays, **provenance)
    except UnknownNameError:
        return PlainRecord.from_dataset(arrays, unknown_kind=kind, **provenance)


def _prefix(number: int) -> str:
    return f"r{number}_"
