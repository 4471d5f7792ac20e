"""Results on disk: netCDF 3 through SciPy, opened as data and never unpickled."""

from __future__ import annotations

import io
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray

from vibrokit.errors import UnknownNameError, VibrokitError, nearest
from vibrokit.results.action_plot import ActionPlotResult
from vibrokit.results.atomic import write_atomically
from vibrokit.results.energy import ActivationEnergy, ExitPath
from vibrokit.results.result import Result

_KINDS: Mapping[str, type[Result]] = {kind.kind: kind for kind in (ActionPlotResult,)}
_FORMAT = 1
_NUMBERS = ("source", "target", "value", "lower", "upper", "residual")
_PATH = "path{index}_"


class ResultFileError(VibrokitError, ValueError):
    """A file that is not a saved result."""


def save_result(result: Result, path: str | os.PathLike[str]) -> None:
    """Write a result to a netCDF file, whole or not at all."""
    arrays: dict[str, Any] = {}
    for name in _NUMBERS:
        arrays[f"energy_{name}"] = ("energy", np.array([getattr(energy, name) for energy in result.energies]))
    for index, energy in enumerate(result.energies):
        if energy.path is not None:
            arrays |= _path_arrays(_PATH.format(index=index), energy.path)
    header = {
        "format": _FORMAT,
        "kind": result.kind,
        "methods": [energy.method for energy in result.energies],
        "scene": dict(result.scene),
        "settings": dict(result.settings),
        "status": result.status,
        "seconds": result.seconds,
        "versions": dict(result.versions),
        "seed": None if result.seed is None else str(result.seed),
    }
    dataset = result.data.assign(arrays).assign_attrs(vibrokit=json.dumps(header))
    content = dataset.to_netcdf(path=None, engine="scipy")
    write_atomically(Path(path), bytes(content))


def _path_arrays(prefix: str, path: ExitPath) -> dict[str, Any]:
    sample, state, section = f"{prefix}sample", f"{prefix}state", f"{prefix}section"
    return {
        f"{prefix}t": (sample, path.t),
        f"{prefix}q": ((sample, state), path.q),
        f"{prefix}p": ((sample, state), path.p),
        f"{prefix}action": (sample, path.action),
        f"{prefix}on_section": (section, path.section),
    }


def load_result(path: str | os.PathLike[str]) -> Result:
    """Open a saved result.

    Raises
    ------
    ResultFileError
        The file is no saved result.
    FileNotFoundError
        There is no such file.
    """
    content = Path(path).read_bytes()
    try:
        dataset = xarray.load_dataset(io.BytesIO(content), engine="scipy", decode_times=False)
        header = json.loads(dataset.attrs.pop("vibrokit"))
        return _read(dataset, header)
    except (ValueError, TypeError, KeyError, AttributeError, OSError, IndexError, OverflowError) as error:
        raise ResultFileError(
            f"{path} is no result that vibrokit saved ({type(error).__name__}: {error}); give a file written by save."
        ) from error


def _read(dataset: xarray.Dataset, header: dict[str, Any]) -> Result:
    kind = header["kind"]
    if kind not in _KINDS:
        raise UnknownNameError(f"result of unknown kind {kind!r}{nearest(kind, _KINDS)}")
    energies = []
    for index, method in enumerate(header["methods"]):
        source, target, value, lower, upper, residual = (float(dataset[f"energy_{n}"][index]) for n in _NUMBERS)
        path = _read_path(dataset, _PATH.format(index=index))
        energies.append(ActivationEnergy(int(source), int(target), value, lower, upper, method, residual, path))
    own = [name for name in dataset.variables if str(name).startswith(("energy_", "path"))]
    seed = header["seed"]
    return _KINDS[kind](
        energies=tuple(energies),
        data=dataset.drop_vars(own),
        scene=header["scene"],
        settings=header["settings"],
        status=header["status"],
        seconds=header["seconds"],
        versions=header["versions"],
        seed=None if seed is None else int(seed),
    )


def _read_path(dataset: xarray.Dataset, prefix: str) -> ExitPath | None:
    if f"{prefix}t" not in dataset:
        return None
    names = ("t", "q", "p", "action", "on_section")
    return ExitPath(*(np.array(dataset[f"{prefix}{name}"].values) for name in names))
