"""Records inside a record: their arrays beside one another in one dataset, each with a prefix, and their provenance."""

from __future__ import annotations

from collections.abc import Mapping

import xarray

from vibrokit.errors import ResultFileError, shown
from vibrokit.results.files import record_from
from vibrokit.results.provenance import json_data, json_text
from vibrokit.results.record import Record

_CONTENTS = "records"  # attribute: names of the records, in the order of their prefixes


def nested(records: Mapping[str, Record]) -> xarray.Dataset:
    """Return the arrays of several records, by name, as one dataset; raises ResultFileError."""
    whole = xarray.Dataset(attrs={_CONTENTS: json_text(list(records))})
    for number, record in enumerate(records.values()):
        own = record.to_dataset()
        if own.attrs:
            raise ResultFileError(f"a {type(record).__name__} with attributes of its own cannot be part of a record")
        prefixed = own.rename({name: f"r{number}_{name}" for name in {*own.variables, *own.dims}})
        whole = whole.assign(prefixed.data_vars).assign_coords(prefixed.coords)
        whole.attrs[f"r{number}_provenance"] = json_text(record.provenance)
    return whole


def records_in(dataset: xarray.Dataset) -> dict[str, Record]:
    """Return the records that `nested` put together; raises ResultFileError."""
    names = json_data(dataset.attrs.get(_CONTENTS))
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise ResultFileError(f"its records are {shown(names)}, and a list of names is needed")
    found = {}
    for number, name in enumerate(names):
        prefix = f"r{number}_"
        own = dataset[[one for one in dataset.variables if str(one).startswith(prefix)]]
        own = own.rename({one: str(one).removeprefix(prefix) for one in {*own.variables, *own.dims}})
        own.attrs = {}
        found[name] = record_from(own, json_data(dataset.attrs.get(f"{prefix}provenance")))
    return found
