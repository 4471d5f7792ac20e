"""Opens saved results: netCDF 3 through SciPy, read as data and never unpickled."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import xarray

from vibrokit.errors import nearest
from vibrokit.results.action_plot import ActionPlotResult
from vibrokit.results.content import Content, ResultFileError, open_content, seed_of, taken, texts, versions_of
from vibrokit.results.continuation import Continuation
from vibrokit.results.continuation_file import KIND as CONTINUATION
from vibrokit.results.continuation_file import read_continuation
from vibrokit.results.energy import ActivationEnergy, ExitPath
from vibrokit.results.result import Result
from vibrokit.results.structure import Structure
from vibrokit.results.structure_file import KIND as STRUCTURE
from vibrokit.results.structure_file import read_structure
from vibrokit.results.writing import NUMBERS, PATH

__all__ = ["ResultFileError", "load_result"]


def load_result(path: str | os.PathLike[str]) -> Result | Structure | Continuation:
    """Open a saved result.

    Parameters
    ----------
    path : str or path
        A file that `Structure.save`, `Continuation.save` or `Result.save` wrote.

    Returns
    -------
    Result, Structure or Continuation
        Of the class that was saved.

    Raises
    ------
    ResultFileError
        The file is no saved result.
    FileNotFoundError
        There is no such file.
    """
    try:
        content = open_content(path)
        kind = taken(content.header, "kind", str)
        if kind not in _READERS:
            raise ResultFileError(f"it is of unknown kind {kind[:50]!r}{nearest(kind, _READERS).rstrip('.')}")
        return _READERS[kind](content)
    except ResultFileError as error:
        raise ResultFileError(
            f"{path} is no result that vibrokit saved: {error}. Give a file written by save."
        ) from error


def _result_reader(record: type[Result]) -> Callable[[Content], Result]:
    def read(content: Content) -> Result:
        header, dataset = content.header, content.dataset
        names = [name for name in dataset.variables if str(name).startswith(("energy_", "path"))]
        try:
            data = xarray.decode_cf(dataset.drop_vars(names), decode_times=False).load()
        except Exception as error:  # attributes of strange files have xarray raise errors of every kind
            raise ResultFileError(f"{type(error).__name__}: {error}") from error
        return record(
            energies=_energies(content),
            data=data,
            scene=taken(header, "scene", dict),
            settings=taken(header, "settings", dict),
            status=taken(header, "status", str),
            seconds=taken(header, "seconds", float),
            versions=versions_of(header),
            seed=seed_of(header),
        )

    return read


def _energies(content: Content) -> tuple[ActivationEnergy, ...]:
    methods = texts(content.header, "methods")
    if not methods:
        return ()
    columns = [content.numbers(f"energy_{name}", (len(methods),), finite=name in _LABELS) for name in NUMBERS]
    energies = []
    for index, method in enumerate(methods):
        source, target, value, lower, upper, residual = (float(column[index]) for column in columns)
        path = _read_path(content, PATH.format(index=index))
        energies.append(ActivationEnergy(int(source), int(target), value, lower, upper, method, residual, path))
    return tuple(energies)


def _read_path(content: Content, prefix: str) -> ExitPath | None:
    if f"{prefix}t" not in content.dataset:
        return None
    t = content.numbers(f"{prefix}t", (None,))
    state = content.numbers(f"{prefix}q", (len(t), None))
    momenta = content.numbers(f"{prefix}p", state.shape)
    action = content.numbers(f"{prefix}action", (len(t),))
    section = content.wholes(f"{prefix}on_section", (None,), 0, len(t) - 1)
    return ExitPath(t, state, momenta, action, section.astype(np.int64))


_LABELS = ("source", "target")
_READERS: Mapping[str, Callable[[Content], Any]] = {
    STRUCTURE: read_structure,
    CONTINUATION: read_continuation,
    **{record.kind: _result_reader(record) for record in (ActionPlotResult,)},
}
