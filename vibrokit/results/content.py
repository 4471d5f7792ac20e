"""Content of a saved result, which may come from strangers: each piece is checked as it is taken out."""

from __future__ import annotations

import dataclasses
import io
import json
import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import xarray
from numpy.typing import DTypeLike, NDArray

from vibrokit.errors import StructureError, VibrokitError, shown
from vibrokit.results.region import Region

FORMAT = 1
HEADER = "vibrokit"  # the attribute that holds all texts, as JSON
_READINGS = 2  # a sound file is read once, to the byte

T = TypeVar("T")
Shape = tuple[int | None, ...]


class ResultFileError(VibrokitError, ValueError):
    """A file that is not a saved result, or one whose parts contradict one another."""


@dataclasses.dataclass(frozen=True, eq=False)
class Content:
    """Arrays and header of a file.

    Attributes
    ----------
    dataset : xarray.Dataset
        The arrays as they stand in the file: nothing is masked, scaled or taken for a time.
    header : dict
        Texts and single numbers.
    """

    dataset: xarray.Dataset
    header: Mapping[str, Any]

    def numbers(self, name: str, shape: Shape, *, finite: bool = True) -> NDArray[np.float64]:
        """Return an array of real numbers.

        Parameters
        ----------
        name : str
        shape : tuple
            None stands for any length.
        finite : bool
            Whether infinity and NaN are refused.

        Raises
        ------
        ResultFileError
            It is missing, has another shape, or holds what is no number.
        """
        values = self._array(name, shape)
        if finite and not np.isfinite(values).all():
            raise ResultFileError(f"its array {name!r} holds NaN or infinity where numbers are needed")
        return np.array(values, dtype=np.float64)

    def wholes(self, name: str, shape: Shape, low: int, high: int, *, dtype: DTypeLike = np.int64) -> NDArray[Any]:
        """Return an array of whole numbers from `low` to `high`; raises like `numbers`."""
        values = self._array(name, shape)
        if values.dtype.kind == "f" and not np.all(values == np.floor(values)):  # false for NaN too
            raise ResultFileError(f"its array {name!r} holds numbers that are not whole")
        if values.size and not (low <= values.min() and values.max() <= high):
            raise ResultFileError(
                f"its array {name!r} goes from {values.min():g} to {values.max():g}; {low} to {high} is allowed"
            )
        return np.array(values, dtype=dtype)

    def _array(self, name: str, shape: Shape) -> NDArray[Any]:
        if name not in self.dataset.variables:
            raise ResultFileError(f"it has no array {name!r}")
        values = self.dataset.variables[name].values
        if values.dtype.kind not in "fi":
            raise ResultFileError(f"its array {name!r} is of kind {values.dtype.name}, and numbers are needed")
        if values.size == 0:
            raise ResultFileError(f"its array {name!r} is empty")
        fits = values.ndim == len(shape) and all(
            wanted in (None, length) for wanted, length in zip(shape, values.shape, strict=True)
        )
        if not fits:
            wanted = " × ".join("any" if length is None else str(length) for length in shape)
            raise ResultFileError(f"its array {name!r} has shape {values.shape}; {wanted} is needed")
        return values


def taken(table: Any, key: str, kind: type[T]) -> T:
    """Return an entry of a table of the header.

    Raises
    ------
    ResultFileError
        It is missing or of another type.
    """
    if not isinstance(table, dict) or key not in table:
        raise ResultFileError(f"its header lacks {key!r}")
    value = table[key]
    if kind is float and isinstance(value, int) and not isinstance(value, bool) and abs(value) < 2**53:
        value = float(value)
    if not isinstance(value, kind) or (isinstance(value, bool) and kind is not bool):
        raise ResultFileError(f"its header has {key} = {shown(value)}, which is no {kind.__name__}")
    if isinstance(value, float) and not math.isfinite(value):
        raise ResultFileError(f"its header has {key} = {value}, and a finite number is needed")
    return value


def texts(table: Any, key: str) -> list[str]:
    """Return an entry that is a list of texts; raises like `taken`."""
    values = taken(table, key, list)
    if not all(isinstance(value, str) for value in values):
        raise ResultFileError(f"its header has {key} = {shown(values)}, which is no list of texts")
    return values


def seed_of(header: Any) -> int | None:
    """Return the seed, which is kept as text because it may be longer than a number in a file."""
    if isinstance(header, dict) and header.get("seed", "") is None:
        return None
    text = taken(header, "seed", str)
    if not (text.isascii() and text.isdigit() and len(text) < 1000):
        raise ResultFileError(f"its header has seed = {shown(text)}, which is no whole number")
    return int(text)


def versions_of(header: Any) -> dict[str, str]:
    """Return the versions by name."""
    versions = taken(header, "versions", dict)
    return {str(name): taken(versions, name, str) for name in versions}


def region_of(content: Content) -> Region:
    """Return the region that a grid is laid over.

    Raises
    ------
    ResultFileError
        It is missing, or no region.
    """
    x, v = (tuple(bounds) for bounds in content.numbers("region", (2, 2)).tolist())
    try:
        return Region(x, v)
    except StructureError as error:
        raise ResultFileError(f"its {error}") from error


class _ReadOnce(io.BytesIO):
    """Bytes that are read about once: arrays that all claim the same bytes could fill any memory."""

    left = 0

    def read(self, size: int | None = -1, /) -> bytes:
        content = super().read(size)
        self.left -= len(content)
        if self.left < 0:
            raise ResultFileError("its arrays claim more bytes than it has")
        return content


def open_content(path: str | os.PathLike[str]) -> Content:
    """Read a file whole.

    Raises
    ------
    ResultFileError
        It is no netCDF 3 file with vibrokit's header.
    FileNotFoundError
        There is no such file.
    """
    try:
        content = Path(path).read_bytes()
    except FileNotFoundError:
        raise
    except (OSError, TypeError, ValueError) as error:
        raise ResultFileError(f"it cannot be read ({error})") from error
    file = _ReadOnce(content)
    file.left = _READINGS * len(content) + 1024
    try:
        dataset = xarray.load_dataset(file, engine="scipy", decode_cf=False)
    except ResultFileError:
        raise
    except Exception as error:  # what SciPy and xarray raise at strange bytes is of every kind
        raise ResultFileError(f"it is no netCDF 3 file, or a damaged one ({type(error).__name__})") from error
    try:
        header = json.loads(dataset.attrs.pop(HEADER))
    except (KeyError, TypeError, ValueError, RecursionError) as error:
        raise ResultFileError(f"it has no attribute {HEADER!r}, or none in JSON ({type(error).__name__})") from error
    if taken(header, "format", int) != FORMAT:
        raise ResultFileError(f"it is of format {header['format']!r}, and this version reads format {FORMAT}")
    return Content(dataset, header)
