"""Datasets as the bytes of netCDF 3 files, through SciPy: read as data and never unpickled."""

from __future__ import annotations

import io
from collections.abc import Hashable, Mapping
from typing import Any

import numpy as np
import xarray

from vibrokit.errors import ResultFileError
from vibrokit.results.arrays import LARGEST_WHOLE, taken
from vibrokit.results.provenance import json_data, json_text

HEADER = "vibrokit"
"""The attribute that holds the provenance as JSON."""
ATTRIBUTES = ("title", "Conventions", "source", "history", "status", HEADER)
"""Attributes that every file has, besides those of its record's own dataset."""

_READINGS = 2  # a sound file is read once, to the byte
_MAGIC = b"CDF"  # how netCDF 3 files begin
_INT32 = np.iinfo(np.int32)
_DTYPES: dict[str, Any] = {"f": np.float64, "i": np.int64, "u": np.int64, "b": np.bool_, "U": np.dtype("<U1")}


def content_of(arrays: xarray.Dataset, attributes: Mapping[str, str], header: Mapping[str, Any]) -> bytes:
    """Return a file that holds arrays, attributes and a header; raises ResultFileError where netCDF 3 cannot."""
    for name in ATTRIBUTES:
        if name in arrays.attrs:
            raise ResultFileError(f"its dataset has an attribute {name!r}, a name that files use; give it another name")
    empty = {str(name): array for name, array in arrays.variables.items() if array.size == 0}
    full = arrays.drop_vars(list(empty)).drop_encoding()
    full = full.assign({name: _storable(name, array) for name, array in full.variables.items()})
    shapes = {name: _shape(array) for name, array in empty.items()}
    full.attrs |= {**attributes, HEADER: json_text({**header, "empty": shapes})}
    plain: dict[Hashable, dict[str, Any]] = {name: {"_FillValue": None} for name in full.variables}
    try:
        return bytes(full.to_netcdf(path=None, engine="scipy", encoding=plain))
    except Exception as error:  # what xarray and SciPy raise at what they cannot write is of every kind
        raise ResultFileError(
            f"netCDF 3 holds numbers, texts and plain names, and not what it has ({error})"
        ) from error  # fmt: skip


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


class _ReadOnce(io.BytesIO):
    """Bytes that are read about once: arrays that all claim the same bytes could fill any memory."""

    left = 0

    def read(self, size: int | None = -1, /) -> bytes:
        content = super().read(size)
        self.left -= len(content)
        if self.left < 0:
            raise ResultFileError("its arrays claim more bytes than it has")
        return content


def opened(content: bytes) -> tuple[xarray.Dataset, Any]:
    """Return the arrays of a file and its header, unchecked; nothing is masked, scaled or taken for a time.

    Raises ResultFileError.
    """
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
    return dataset, json_data(dataset.attrs[HEADER])


def arrays_in(dataset: xarray.Dataset, header: Any) -> xarray.Dataset:
    """Return the arrays that `content_of` was given, those without an entry too; raises ResultFileError."""
    dataset.attrs = {name: value for name, value in dataset.attrs.items() if name not in ATTRIBUTES}
    try:
        whole = dataset.assign(
            {
                name: (
                    tuple(map(str, taken(entry, "dims", list))),
                    np.empty(taken(entry, "shape", list), dtype=_DTYPES[taken(entry, "dtype", str)]),
                )
                for name, entry in taken(header, "empty", dict).items()
                if 0 in taken(entry, "shape", list)
            }
        )
    except (LookupError, TypeError, ValueError, ArithmeticError) as error:
        raise ResultFileError(f"its empty arrays contradict the others ({error})") from error
    return whole.drop_encoding()
