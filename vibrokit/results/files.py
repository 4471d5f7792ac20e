"""Saved records: netCDF 3 through SciPy, read as data and never unpickled."""

from __future__ import annotations

import io
import os
from collections.abc import Hashable
from pathlib import Path
from typing import Any

import numpy as np
import xarray

from vibrokit.arguments import path_of
from vibrokit.construction import called
from vibrokit.errors import NoSuchFileError, ResultFileError, UnknownNameError, nearest_form, reason, shown
from vibrokit.registry import Group, load
from vibrokit.results.arrays import LARGEST_WHOLE, taken
from vibrokit.results.atomic import write_atomically
from vibrokit.results.plain import PlainRecord
from vibrokit.results.provenance import FORMAT, json_data, provenance_from, provenance_text
from vibrokit.results.record import Record

__all__ = ["ResultFileError", "load_result", "save_record"]

HEADER = "vibrokit"
"""The attribute that holds the provenance as JSON."""
ATTRIBUTES = ("title", "Conventions", "source", "history", "status", HEADER)
"""Attributes that every file has, besides those of its record's own dataset."""

_READINGS = 2  # a sound file is read once, to the byte
_MAGIC = b"CDF"  # how netCDF 3 files begin
_NO_WRITER = "Give a file written by save."
_INT32 = np.iinfo(np.int32)


def save_record(record: Record, path: str | os.PathLike[str]) -> None:
    """Write a record to a netCDF file, whole or not at all; raises ResultFileError where netCDF 3 cannot hold it."""
    try:
        content = _content(record)
    except ResultFileError as error:
        raise ResultFileError(f"{type(record).__name__} cannot be saved: {str(error).rstrip('.')}.") from error
    write_atomically(path, content)


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
        dataset, header = _opened(content)
        advice = _advice(header)
        dataset = _checked(dataset, header)
        kind = taken(header, "kind", str)
        provenance = provenance_from(header)
        try:
            record = load(Group.RECORDS, kind, Record)
        except UnknownNameError:
            return PlainRecord.from_dataset(dataset, unknown_kind=kind, content=content, **provenance)
        return record.from_dataset(dataset, **provenance)
    except ResultFileError as error:
        raise ResultFileError(
            f"{where} is no result that this vibrokit can open: {str(error).rstrip('.')}. {advice}"
        ) from error


# Writing


def _content(record: Record) -> bytes:
    if isinstance(record, PlainRecord):
        return record.content
    arrays = record.to_dataset()
    for name in ATTRIBUTES:
        if name in arrays.attrs:
            raise ResultFileError(f"its dataset has an attribute {name!r}, a name that files use; give it another name")
    empty = {str(name): array for name, array in arrays.variables.items() if array.size == 0}
    full = arrays.drop_vars(list(empty)).drop_encoding()
    full = full.assign({name: _storable(name, array) for name, array in full.variables.items()})
    full.attrs |= _attributes(record, {name: _shape(array) for name, array in empty.items()})
    plain: dict[Hashable, dict[str, Any]] = {name: {"_FillValue": None} for name in full.variables}
    try:
        return bytes(full.to_netcdf(path=None, engine="scipy", encoding=plain))
    except Exception as error:  # what xarray and SciPy raise at what they cannot write is of every kind
        raise ResultFileError(
            f"netCDF 3 holds numbers, texts and plain names, and not what it has ({error})"
        ) from error  # fmt: skip


def _attributes(record: Record, empty: dict[str, Any]) -> dict[str, Any]:
    """Attributes for people who look into a file, and the provenance."""
    document = (type(record).__doc__ or "").strip().partition("\n")[0]
    software = f"vibrokit {record.versions.get('vibrokit', '')}".strip()
    seed = "" if record.seed is None else f", seed {record.seed}"
    return {
        "title": f"{record.kind}: {document}",
        "Conventions": "CF-1.11",
        "source": software,
        "history": f"computed by {software} in {record.seconds:.1f} s{seed}",
        "status": record.status,
        HEADER: provenance_text(record, empty=empty),
    }


def _storable(name: Hashable, array: xarray.Variable) -> xarray.Variable:
    """A variable as netCDF 3 holds it: whole numbers of 32 bits, or as floats where that is too short."""
    if array.dtype.kind not in "iu" or array.dtype.itemsize < 4:
        return array
    low, high = int(array.min()), int(array.max())
    if _INT32.min <= low and high <= _INT32.max:
        return array.astype(np.int32)
    if max(-low, high) > LARGEST_WHOLE:
        raise ResultFileError(f"its array {name!r} goes from {low} to {high}, which netCDF 3 cannot hold exactly")
    return array.astype(np.float64)


def _shape(array: xarray.Variable) -> dict[str, Any]:
    """What is left to say of an array without an entry, for netCDF 3 takes a length of 0 for something else."""
    return {"dims": [str(dim) for dim in array.dims], "shape": list(array.shape), "dtype": array.dtype.kind}


# Reading


class _ReadOnce(io.BytesIO):
    """Bytes that are read about once: arrays that all claim the same bytes could fill any memory."""

    left = 0

    def read(self, size: int | None = -1, /) -> bytes:
        content = super().read(size)
        self.left -= len(content)
        if self.left < 0:
            raise ResultFileError("its arrays claim more bytes than it has")
        return content


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except FileNotFoundError as error:
        raise NoSuchFileError(f"there is no file {path}{_beside(path)}") from error
    except (OSError, ValueError) as error:
        raise ResultFileError(f"it cannot be read ({reason(error)})") from error


def _beside(path: Path) -> str:
    """The end of a sentence that names the closest of the results in the same folder."""
    known = {file.name: str(file) for file in path.parent.glob("*.nc")} if path.parent.is_dir() else {}
    return nearest_form(path.name, known) if known else "; give a file written by save."


def _opened(content: bytes) -> tuple[xarray.Dataset, Any]:
    """The arrays of a file and its provenance. Nothing is masked, scaled or taken for a time."""
    if not content.startswith(_MAGIC):
        raise ResultFileError("it is not a netCDF 3 file" if content else "it is empty")
    file = _ReadOnce(content)
    file.left = _READINGS * len(content) + 1024
    try:
        dataset = xarray.load_dataset(
            file, engine="scipy", mask_and_scale=False, decode_times=False, decode_timedelta=False
        )
    except ResultFileError:
        raise
    except Exception as error:  # what SciPy and xarray raise at strange bytes is of every kind
        raise ResultFileError("it is damaged, perhaps cut short") from error
    if HEADER not in dataset.attrs:
        raise ResultFileError(f"it has no attribute {HEADER!r}")
    header = json_data(dataset.attrs[HEADER])
    return dataset, header


def _advice(header: Any) -> str:
    """What to do with a file that cannot be opened, by who wrote it."""
    try:
        writer = taken(taken(header, "versions", dict), "vibrokit", str)
    except ResultFileError:
        return _NO_WRITER
    return f"It was written by vibrokit {writer}: open it with that version, or compute it again."


def _checked(dataset: xarray.Dataset, header: Any) -> xarray.Dataset:
    """The arrays of a record, if this version reads the format."""
    if taken(header, "format", int) != FORMAT:
        raise ResultFileError(f"it is of format {shown(header['format'])}, and format {FORMAT} is read")
    dataset.attrs = {name: value for name, value in dataset.attrs.items() if name not in ATTRIBUTES}
    return _with_empty(dataset, taken(header, "empty", dict)).drop_encoding()


def _with_empty(dataset: xarray.Dataset, empty: dict[str, Any]) -> xarray.Dataset:
    """A dataset with the arrays without an entry that its file names."""
    try:
        return dataset.assign(
            {
                name: (
                    tuple(map(str, taken(entry, "dims", list))),
                    np.empty(taken(entry, "shape", list), dtype=_DTYPES[taken(entry, "dtype", str)]),
                )
                for name, entry in empty.items()
                if 0 in taken(entry, "shape", list)
            }
        )
    except (LookupError, TypeError, ValueError, ArithmeticError) as error:
        raise ResultFileError(f"its empty arrays contradict the others ({error})") from error


_DTYPES: dict[str, Any] = {"f": np.float64, "i": np.int64, "u": np.int64, "b": np.bool_, "U": np.dtype("<U1")}
