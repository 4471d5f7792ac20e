"""Opens saved results: netCDF 3 through SciPy, read as data and never unpickled."""

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
from vibrokit.results.energy import ActivationEnergy, ExitPath
from vibrokit.results.result import Result
from vibrokit.results.writing import NUMBERS, PATH

_KINDS: Mapping[str, type[Result]] = {kind.kind: kind for kind in (ActionPlotResult,)}


class ResultFileError(VibrokitError, ValueError):
    """A file that is not a saved result."""


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
        source, target, value, lower, upper, residual = (float(dataset[f"energy_{n}"][index]) for n in NUMBERS)
        path = _read_path(dataset, PATH.format(index=index))
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
