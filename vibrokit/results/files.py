"""load_result: opens a saved record."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import xarray

from vibrokit.arguments import path_of
from vibrokit.construction import called
from vibrokit.errors import NoSuchFileError, ResultFileError, UnknownNameError, nearest_form, reason, shown
from vibrokit.registry import Group, load
from vibrokit.results.arrays import taken
from vibrokit.results.netcdf import arrays_in, opened
from vibrokit.results.plain import PlainRecord
from vibrokit.results.provenance import FORMAT, provenance_from
from vibrokit.results.record import Record

__all__ = ["ResultFileError", "load_result", "record_from"]

_NO_WRITER = "Give a file written by save."


@called
def load_result(path: str | os.PathLike[str]) -> Any:
    """Open a saved `Record`, such as a `Result` or a `Structure`.

    Parameters
    ----------
    path : str or path
        A file that `save` wrote.

    Returns
    -------
    Record
        Of the class that was saved. If no installed package registers its kind, a `PlainRecord`.

    Raises
    ------
    ResultFileError
        The file is not a saved record, or cannot be read.
    NoSuchFileError
        There is no such file.
    """
    where, advice = path_of(path), _NO_WRITER
    try:
        content = _read(where)
        dataset, header = opened(content)
        advice = _advice(header)
        if taken(header, "format", int) != FORMAT:
            raise ResultFileError(f"it is of format {shown(header['format'])}, and format {FORMAT} is read")
        return record_from(arrays_in(dataset, header), header, content)
    except ResultFileError as error:
        raise ResultFileError(
            f"{where} is no result that this vibrokit can open: {str(error).rstrip('.')}. {advice}"
        ) from error


def record_from(dataset: xarray.Dataset, header: Any, content: bytes = b"") -> Record:
    """Make a record of its arrays and its provenance as plain data; raises ResultFileError."""
    kind, provenance = taken(header, "kind", str), provenance_from(header)
    try:
        record = load(Group.RECORDS, kind, Record)
    except UnknownNameError:
        return PlainRecord.from_dataset(dataset, unknown_kind=kind, content=content, **provenance)
    return record.from_dataset(dataset, **provenance)


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except FileNotFoundError as error:
        known = {file.name: str(file) for file in path.parent.glob("*.nc")} if path.parent.is_dir() else {}
        closest = nearest_form(path.name, known) if known else "; give a file written by save."
        raise NoSuchFileError(f"there is no file {path}{closest}") from error
    except (OSError, ValueError) as error:
        raise ResultFileError(f"it cannot be read ({reason(error)})") from error


def _advice(header: Any) -> str:
    """What to do with a file that cannot be opened, by who wrote it."""
    try:
        writer = taken(taken(header, "versions", dict), "vibrokit", str)
    except ResultFileError:
        return _NO_WRITER
    return f"It was written by vibrokit {writer}: open it with that version, or compute it again."
