"""Writes results: netCDF 3 through SciPy, flat names, the scene and settings as JSON."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray

from vibrokit.results.atomic import write_atomically
from vibrokit.results.content import FORMAT, HEADER
from vibrokit.results.energy import ExitPath

if TYPE_CHECKING:
    from vibrokit.results.result import Result

NUMBERS = ("source", "target", "value", "lower", "upper", "residual")
PATH = "path{index}_"


def save_result(result: Result, path: str | os.PathLike[str]) -> None:
    """Write a result to a netCDF file, whole or not at all."""
    arrays: dict[str, Any] = {}
    for name in NUMBERS if result.energies else ():  # an array without an entry would be none to netCDF 3
        arrays[f"energy_{name}"] = ("energy", np.array([getattr(energy, name) for energy in result.energies]))
    for index, energy in enumerate(result.energies):
        if energy.path is not None:
            arrays |= _path_arrays(PATH.format(index=index), energy.path)
    header = {
        "format": FORMAT,
        "kind": result.kind,
        "methods": [energy.method for energy in result.energies],
        "scene": dict(result.scene),
        "settings": dict(result.settings),
        "status": result.status,
        "seconds": result.seconds,
        "versions": dict(result.versions),
        "seed": None if result.seed is None else str(result.seed),
    }
    dataset = result.data.assign(arrays).assign_attrs({HEADER: json.dumps(header)})
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


def _path_arrays(prefix: str, path: ExitPath) -> dict[str, Any]:
    sample, state, section = f"{prefix}sample", f"{prefix}state", f"{prefix}section"
    return {
        f"{prefix}t": (sample, path.t),
        f"{prefix}q": ((sample, state), path.q),
        f"{prefix}p": ((sample, state), path.p),
        f"{prefix}action": (sample, path.action),
        f"{prefix}on_section": (section, path.section),
    }
