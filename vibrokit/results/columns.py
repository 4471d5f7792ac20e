"""Columns: how one attribute of many records stands in a file, and how it is read back.

Attributes of one number each make an array with an entry per record. Those that are arrays themselves, of a length that
differs from record to record, are laid end to end beside an array of their lengths: what the CF conventions
(cfconventions.org, section 9.3.3) call a contiguous ragged array. Arrays without an entry are left out, for netCDF 3
takes a length of 0 for something else.
"""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import shown
from vibrokit.results.content import Content, ResultFileError, taken, texts

_LARGEST = 2**53
_INT32 = np.iinfo(np.int32)


@dataclasses.dataclass(frozen=True, eq=False)
class Draft:
    """A file in the making: arrays with the names of their dimensions, and the header."""

    arrays: dict[str, tuple[Any, NDArray[Any]]] = dataclasses.field(default_factory=dict)
    header: dict[str, Any] = dataclasses.field(default_factory=dict)

    def put(self, name: str, dimensions: Sequence[str], values: NDArray[Any]) -> None:
        """Add an array, unless it is empty; whole numbers as 32 bits, or where that is too short as floats."""
        if values.size == 0:
            return
        if values.dtype.kind in "iu" and values.dtype.itemsize > 4:
            fits = _INT32.min <= values.min() and values.max() <= _INT32.max
            values = values.astype(np.int32 if fits else np.float64)
        self.arrays[name] = (tuple(dimensions), values)

    def put_pieces(self, name: str, pieces: Sequence[NDArray[Any]], record: str) -> None:
        """Add arrays of differing lengths, end to end, and their lengths."""
        self.put(f"{name}_count", (record,), np.array([len(piece) for piece in pieces]))
        filled = [piece for piece in pieces if len(piece)]
        if filled:
            if len({piece.shape[1:] for piece in filled}) > 1:
                raise ResultFileError(f"{name} differ in width ({[p.shape for p in filled]}) and were not saved.")
            self.put(name, (f"{name}_entry", f"{name}_state")[: filled[0].ndim], np.concatenate(filled))


class Column(ABC):
    """One attribute of many records."""

    @abstractmethod
    def write(self, draft: Draft, record: str, name: str, values: Sequence[Any]) -> None:
        """Put the attribute `name` of records called `record` into a draft."""

    @abstractmethod
    def read(self, content: Content, record: str, name: str, count: int) -> list[Any]:
        """Take it out of a file for `count` records; raises ResultFileError."""


@dataclasses.dataclass(frozen=True)
class Number(Column):
    """A real number, finite if it has bounds."""

    low: float = -np.inf
    high: float = np.inf

    def write(self, draft: Draft, record: str, name: str, values: Sequence[Any]) -> None:
        draft.put(f"{record}_{name}", (record,), np.array(values, dtype=float))

    def read(self, content: Content, record: str, name: str, count: int) -> list[Any]:
        if count == 0:
            return []
        bounded = self.low > -np.inf or self.high < np.inf
        values = content.numbers(f"{record}_{name}", (count,), finite=bounded)
        if bounded and not np.all((self.low <= values) & (values <= self.high)):
            raise ResultFileError(f"its array {f'{record}_{name}'!r} leaves the range {self.low:g} to {self.high:g}")
        return values.tolist()


@dataclasses.dataclass(frozen=True)
class Whole(Column):
    """A whole number."""

    low: int = 0
    high: int = _LARGEST

    def write(self, draft: Draft, record: str, name: str, values: Sequence[Any]) -> None:
        draft.put(f"{record}_{name}", (record,), np.array(values, dtype=np.int64))

    def read(self, content: Content, record: str, name: str, count: int) -> list[Any]:
        return content.wholes(f"{record}_{name}", (count,), self.low, self.high).tolist() if count else []


@dataclasses.dataclass(frozen=True)
class Flag(Column):
    """True or False."""

    def write(self, draft: Draft, record: str, name: str, values: Sequence[Any]) -> None:
        draft.put(f"{record}_{name}", (record,), np.array(values, dtype=np.int8))

    def read(self, content: Content, record: str, name: str, count: int) -> list[Any]:
        return [bool(value) for value in Whole(0, 1).read(content, record, name, count)]


@dataclasses.dataclass(frozen=True)
class Word(Column):
    """A text; one of `known`, if that is given."""

    known: tuple[str, ...] = ()

    def write(self, draft: Draft, record: str, name: str, values: Sequence[Any]) -> None:
        draft.header[f"{record}_{name}"] = list(values)

    def read(self, content: Content, record: str, name: str, count: int) -> list[Any]:
        words = _listed(texts(content.header, f"{record}_{name}"), f"{record}_{name}", count)
        for word in words:
            if self.known and word not in self.known:
                raise ResultFileError(f"it has {record} of {name} {word[:50]!r}; there are {', '.join(self.known)}")
        return words


@dataclasses.dataclass(frozen=True)
class Rows(Column):
    """An array (any length, width), all finite; the same width in all records where none is said."""

    width: int | None = None

    def write(self, draft: Draft, record: str, name: str, values: Sequence[Any]) -> None:
        draft.put_pieces(f"{record}_{name}", values, record)

    def read(self, content: Content, record: str, name: str, count: int) -> list[Any]:
        cuts = _cuts(content, f"{record}_{name}", count)
        if cuts is None:
            return [np.empty((0, self.width or 2)) for _ in range(count)]
        return _split(content.numbers(f"{record}_{name}", (int(cuts[-1]), self.width)), cuts)


@dataclasses.dataclass(frozen=True)
class Spectrum(Column):
    """An array of complex numbers, real and imaginary parts apart; `finite`: neither NaN nor infinity."""

    finite: bool

    def write(self, draft: Draft, record: str, name: str, values: Sequence[Any]) -> None:
        for part, pieces in (("real", [v.real for v in values]), ("imag", [v.imag for v in values])):
            draft.put_pieces(f"{record}_{name}_{part}", [np.asarray(piece, dtype=float) for piece in pieces], record)

    def read(self, content: Content, record: str, name: str, count: int) -> list[Any]:
        parts = []
        for part in ("real", "imag"):
            own = f"{record}_{name}_{part}"
            cuts = _cuts(content, own, count)
            values = np.empty(0) if cuts is None else content.numbers(own, (int(cuts[-1]),), finite=self.finite)
            parts.append(_split(values, cuts) if cuts is not None else [np.empty(0)] * count)
        joined = []
        for real, imag in zip(*parts, strict=True):
            if len(real) != len(imag):
                raise ResultFileError(f"its {record}_{name} has {len(real)} real and {len(imag)} imaginary parts")
            values = np.empty(len(real), dtype=complex)  # real + 1j·imag would turn an infinite part into NaN
            values.real, values.imag = real, imag
            joined.append(values)
        return joined


@dataclasses.dataclass(frozen=True)
class Wholes(Column):
    """An array of whole numbers."""

    low: int
    high: int = _LARGEST

    def write(self, draft: Draft, record: str, name: str, values: Sequence[Any]) -> None:
        draft.put_pieces(f"{record}_{name}", [np.asarray(value, dtype=np.int64) for value in values], record)

    def read(self, content: Content, record: str, name: str, count: int) -> list[Any]:
        cuts = _cuts(content, f"{record}_{name}", count)
        if cuts is None:
            return [np.empty(0, dtype=np.int64) for _ in range(count)]
        return _split(content.wholes(f"{record}_{name}", (int(cuts[-1]),), self.low, self.high), cuts)


@dataclasses.dataclass(frozen=True)
class BySide(Column):
    """A finite number, 0 or more, for each side of the mass where there is a stop."""

    def write(self, draft: Draft, record: str, name: str, values: Sequence[Any]) -> None:
        draft.header[f"{record}_{name}_sides"] = [list(value) for value in values]
        draft.put_pieces(f"{record}_{name}", [np.array(list(v.values()), dtype=float) for v in values], record)

    def read(self, content: Content, record: str, name: str, count: int) -> list[Any]:
        key = f"{record}_{name}_sides"
        listed = _listed(taken(content.header, key, list), key, count)
        cuts = _cuts(content, f"{record}_{name}", count)
        values = np.empty(0) if cuts is None else content.numbers(f"{record}_{name}", (int(cuts[-1]),))
        if (values < 0).any():
            raise ResultFileError(f"its array {f'{record}_{name}'!r} holds negative numbers; 0 or more is needed")
        pieces = _split(values, cuts) if cuts is not None else [values] * count
        return [_sided(sides, piece, key) for sides, piece in zip(listed, pieces, strict=True)]


def _sided(sides: Any, values: NDArray[np.float64], key: str) -> dict[str, float]:
    known = isinstance(sides, list) and all(side in ("left", "right") for side in sides)
    if not known or len(set(sides)) != len(sides) or len(sides) != len(values):
        raise ResultFileError(f"its header has sides in {key} that are not left and right, or not one for each number")
    return dict(zip(sides, values.tolist(), strict=True))


def _cuts(content: Content, name: str, count: int) -> NDArray[np.int64] | None:
    """Where the pieces of a ragged array end; None if all are empty."""
    if count == 0:
        return None
    counts = content.wholes(f"{name}_count", (count,), 0, _INT32.max).astype(np.int64)
    return np.cumsum(counts) if counts.any() else None


def _split(values: NDArray[Any], cuts: NDArray[np.int64]) -> list[NDArray[Any]]:
    return [piece.copy() for piece in np.split(values, cuts[:-1])]


def _listed(values: list[Any], key: str, count: int) -> list[Any]:
    if len(values) != count:
        raise ResultFileError(f"its header has {len(values)} entries in {key}; {count} are needed")
    return values


@dataclasses.dataclass(frozen=True)
class Table:
    """Records of one kind: the name that goes before each array, and a column for each attribute."""

    record: str
    columns: Mapping[str, Column]

    def write(self, draft: Draft, records: Sequence[Any]) -> None:
        """Put all attributes of the records into a draft."""
        draft.header[f"{self.record}s"] = len(records)
        for name, column in self.columns.items():
            column.write(draft, self.record, name, [getattr(record, name) for record in records])

    def read(self, content: Content) -> Iterator[dict[str, Any]]:
        """Return the attributes of each record, by name."""
        count = taken(content.header, f"{self.record}s", int)
        if not 0 <= count <= _INT32.max:
            raise ResultFileError(f"its header claims {shown(count)} {self.record}s")
        columns = [column.read(content, self.record, name, count) for name, column in self.columns.items()]
        return (dict(zip(self.columns, values, strict=True)) for values in zip(*columns, strict=True))
