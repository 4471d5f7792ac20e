"""Arrays of a dataset that may come from a stranger's file: each is checked as it is read."""

from __future__ import annotations

import dataclasses
import math
from typing import Any, TypeVar

import numpy as np
import xarray
from numpy.typing import NDArray

from vibrokit.errors import ResultFileError, shown

LARGEST_WHOLE = 2**53
"""Above this number a float no longer holds every whole number."""

T = TypeVar("T")
Shape = tuple[int | None, ...]


@dataclasses.dataclass(frozen=True, eq=False)
class Arrays:
    """Checked access to a dataset. Every method raises ResultFileError if the array is not as expected."""

    dataset: xarray.Dataset

    def __contains__(self, name: str) -> bool:
        return name in self.dataset.variables

    def size(self, dimension: str) -> int:
        """Return the length of a dimension."""
        if dimension not in self.dataset.sizes:
            raise ResultFileError(f"it has no dimension {dimension!r}")
        return int(self.dataset.sizes[dimension])

    def numbers(
        self, name: str, shape: Shape, low: float = -np.inf, high: float = np.inf, *, finite: bool = True
    ) -> NDArray[np.float64]:
        """Return an array of real numbers from `low` to `high`; None in `shape` stands for any length."""
        values = np.array(self._array(name, shape, "biuf"), dtype=np.float64)
        if finite and not np.isfinite(values).all():
            raise ResultFileError(f"its array {name!r} holds NaN or infinity where finite numbers are needed")
        self._check_range(name, values[~np.isnan(values)], low, high)
        return values

    def wholes(self, name: str, shape: Shape, low: int = 0, high: int = LARGEST_WHOLE) -> NDArray[np.int64]:
        """Return an array of whole numbers from `low` to `high`."""
        values = self._array(name, shape, "biuf")
        if values.dtype.kind == "f" and not np.all(values == np.floor(values)):  # false for NaN too
            raise ResultFileError(f"its array {name!r} holds numbers that are not whole")
        self._check_range(name, values, low, high)
        return np.array(values, dtype=np.int64)

    def words(self, name: str, shape: Shape, known: tuple[str, ...] = ()) -> list[str]:
        """Return an array of texts, each one of `known` if that is given, as a flat list."""
        words: list[Any] = self._array(name, shape, "OUT").ravel().tolist()
        for word in words:
            if not isinstance(word, str):
                raise ResultFileError(f"its array {name!r} holds {shown(word)} where a text is needed")
            if known and word not in known:
                raise ResultFileError(f"its array {name!r} holds {shown(word)}; it may hold {', '.join(known)}")
        return words

    @staticmethod
    def _check_range(name: str, values: NDArray[Any], low: float, high: float) -> None:
        if values.size and not (low <= values.min() and values.max() <= high):
            raise ResultFileError(
                f"its array {name!r} goes from {values.min():g} to {values.max():g}; {low:g} to {high:g} is allowed"
            )

    def _array(self, name: str, shape: Shape, kinds: str) -> NDArray[Any]:
        if name not in self.dataset.variables:
            raise ResultFileError(f"it has no array {name!r}")
        values = np.asarray(self.dataset.variables[name].values)
        if values.dtype.kind not in kinds:
            wanted = "numbers" if "f" in kinds else "texts"
            raise ResultFileError(f"its array {name!r} is of type {values.dtype.name}, and {wanted} are needed")
        fits = values.ndim == len(shape) and all(
            wanted in (None, length) for wanted, length in zip(shape, values.shape, strict=True)
        )
        if not fits:
            wanted = " × ".join("any" if length is None else str(length) for length in shape)
            raise ResultFileError(f"its array {name!r} has shape {values.shape}; {wanted or 'no dimension'} is needed")
        return values


def taken(table: Any, key: str, kind: type[T]) -> T:
    """Return an entry of a table of plain data; raises ResultFileError if it is missing or of another type."""
    if not isinstance(table, dict) or key not in table:
        raise ResultFileError(f"its provenance has no entry {key!r}")
    value = table[key]
    if kind is float and isinstance(value, int) and not isinstance(value, bool) and abs(value) < LARGEST_WHOLE:
        value = float(value)
    if not isinstance(value, kind) or (isinstance(value, bool) and kind is not bool):
        raise ResultFileError(f"its provenance has {key} = {shown(value)}, and {_NOUNS[kind]} is needed")
    if isinstance(value, float) and not math.isfinite(value):
        raise ResultFileError(f"its provenance has {key} = {value}, and a finite number is needed")
    return value


_NOUNS: dict[type, str] = {
    str: "a text", int: "a whole number", float: "a number", bool: "true or false", dict: "a table", list: "a list",
}  # fmt: skip
