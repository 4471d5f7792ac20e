"""Writes results: netCDF 3 through SciPy, flat names, the scene and settings as JSON."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import xarray

from vibrokit.results.atomic import write_atomically
from vibrokit.results.columns import Draft
from vibrokit.results.content import FORMAT, HEADER, ResultFileError
from vibrokit.results.energy_file import ENERGIES, RESERVED

if TYPE_CHECKING:
    from vibrokit.results.result import Result


def save_result(result: Result, path: str | os.PathLike[str]) -> None:
    """Write a result to a netCDF file, whole or not at all.

    Raises
    ------
    ResultFileError
        Its data has an array under a name that is kept for energies, branches or transitions.
    """
    for name in result.data.variables:
        if RESERVED.match(str(name)):
            raise ResultFileError(
                f"the result's data has an array {str(name)!r}, a name that is kept for energies; give it another name."
            )
    draft = Draft()
    ENERGIES.write(draft, result.energies)
    result.write_extras(draft)
    header = {
        "format": FORMAT,
        "kind": result.kind,
        "scene": dict(result.scene),
        "settings": dict(result.settings),
        "status": result.status,
        "seconds": result.seconds,
        "versions": dict(result.versions),
        "seed": None if result.seed is None else str(result.seed),
        **draft.header,
    }
    dataset = result.data.assign(draft.arrays).assign_attrs({HEADER: json.dumps(header)})
    content = dataset.to_netcdf(path=None, engine="scipy")
    write_atomically(Path(path), bytes(content))


def write_content(path: Path, arrays: Mapping[str, tuple[Any, Any]], header: Mapping[str, Any]) -> None:
    """Write arrays, bit for bit, and a header to a netCDF file, whole or not at all.

    Parameters
    ----------
    path : Path
    arrays : dict of str to (dimensions, array)
        None of them empty.
    header : dict
        Plain data.
    """
    text = json.dumps({"format": FORMAT, **header}, allow_nan=False)
    dataset = xarray.Dataset(dict(arrays), attrs={HEADER: text})
    plain: dict[str, dict[str, Any]] = {name: {"_FillValue": None} for name in arrays}  # no NaN stands for "missing"
    write_atomically(path, bytes(dataset.to_netcdf(path=None, engine="scipy", encoding=plain)))
