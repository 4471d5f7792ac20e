"""Opens saved results: netCDF 3 through SciPy, read as data and never unpickled."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from typing import Any

import xarray

from vibrokit.errors import nearest
from vibrokit.results.action_graph import ActionGraphResult
from vibrokit.results.action_plot import ActionPlotResult
from vibrokit.results.content import Content, ResultFileError, open_content, seed_of, taken, versions_of
from vibrokit.results.continuation import Continuation
from vibrokit.results.continuation_file import KIND as CONTINUATION
from vibrokit.results.continuation_file import read_continuation
from vibrokit.results.energy_file import ENERGIES, RESERVED
from vibrokit.results.least_action import LeastActionResult
from vibrokit.results.result import Result
from vibrokit.results.structure import Structure
from vibrokit.results.structure_file import KIND as STRUCTURE
from vibrokit.results.structure_file import read_structure

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
        names = [name for name in dataset.variables if RESERVED.match(str(name))]
        try:
            data = xarray.decode_cf(dataset.drop_vars(names), decode_times=False).load()
        except Exception as error:  # attributes of strange files have xarray raise errors of every kind
            raise ResultFileError(f"{type(error).__name__}: {error}") from error
        return record(
            energies=ENERGIES.read(content),
            data=data,
            scene=taken(header, "scene", dict),
            settings=taken(header, "settings", dict),
            status=taken(header, "status", str),
            seconds=taken(header, "seconds", float),
            versions=versions_of(header),
            seed=seed_of(header),
            **record.read_extras(content),
        )

    return read


_RESULTS = (ActionGraphResult, ActionPlotResult, LeastActionResult)
_READERS: Mapping[str, Callable[[Content], Any]] = {
    STRUCTURE: read_structure,
    CONTINUATION: read_continuation,
    **{record.kind: _result_reader(record) for record in _RESULTS},
}
