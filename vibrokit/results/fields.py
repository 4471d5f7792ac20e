"""Fields: how one attribute of many records lies in a dataset.

A number of each record makes an array with one entry per record. Arrays whose length differs from record to record are
padded with NaN at their ends, beside an array of their lengths; long curves of very different lengths lie end to end
instead, which the CF conventions (cfconventions.org, section 9.3.3) call a contiguous ragged array.
"""

from __future__ import annotations

import dataclasses
import itertools
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from enum import StrEnum
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import ResultFileError
from vibrokit.results.arrays import LARGEST_WHOLE, Arrays

Variable = tuple[tuple[str, ...], NDArray[Any], dict[str, Any]]
Array = NDArray[np.float64]

LARGEST = float(np.finfo(float).max)


def _about(long_name: str, units: str = "1") -> dict[str, Any]:
    """Attributes of an array."""
    return {"long_name": long_name, "units": units} if units else {"long_name": long_name}


@dataclasses.dataclass(frozen=True)
class Field(ABC):
    """One attribute of many records. In every method `record` is their dimension and `name` that of the array.

    A scalar of a single record has no dimension: `record` is empty then.
    """

    noun: ClassVar[str] = ""  # the type of the attribute, if the annotation does not tell it

    long_name: str
    units: str = "1"

    @abstractmethod
    def variables(self, record: str, name: str, values: Sequence[Any]) -> Iterator[tuple[str, Variable]]:
        """Return the arrays that hold the attribute of all records, with their names."""

    @abstractmethod
    def read(self, arrays: Arrays, record: str, name: str) -> list[Any]:
        """Return the attribute of each record; raises ResultFileError."""


@dataclasses.dataclass(frozen=True)
class Scalar(Field):
    """A value of each record. Abstract."""

    dtype: ClassVar[type] = float

    def variables(self, record: str, name: str, values: Sequence[Any]) -> Iterator[tuple[str, Variable]]:
        about = _about(self.long_name, self.units)
        array: NDArray[Any] = np.array(values, dtype=self.dtype)
        yield name, (((record,), array, about) if record else ((), array.reshape(()), about))

    @staticmethod
    def shape(arrays: Arrays, record: str) -> tuple[int, ...]:
        """Return the shape that the array should have."""
        return (arrays.size(record),) if record else ()


@dataclasses.dataclass(frozen=True)
class Number(Scalar):
    """A real number; it may be NaN or infinite unless it has bounds."""

    low: float = -np.inf
    high: float = np.inf

    def read(self, arrays: Arrays, record: str, name: str) -> list[Any]:
        bounded = self.low > -np.inf or self.high < np.inf
        values = arrays.numbers(name, self.shape(arrays, record), self.low, self.high, finite=bounded)
        return values.ravel().tolist()


@dataclasses.dataclass(frozen=True)
class Whole(Scalar):
    """A whole number."""

    dtype: ClassVar[type] = np.int64

    low: int = 0
    high: int = LARGEST_WHOLE

    def read(self, arrays: Arrays, record: str, name: str) -> list[Any]:
        return arrays.wholes(name, self.shape(arrays, record), self.low, self.high).ravel().tolist()


@dataclasses.dataclass(frozen=True)
class Flag(Scalar):
    """True or False."""

    dtype: ClassVar[type] = bool

    units: str = ""

    def read(self, arrays: Arrays, record: str, name: str) -> list[Any]:
        return arrays.wholes(name, self.shape(arrays, record), 0, 1).astype(bool).ravel().tolist()


@dataclasses.dataclass(frozen=True)
class Word(Scalar):
    """A text; one of `known`, if that is given, which may be an enumeration."""

    dtype: ClassVar[type] = str

    units: str = ""
    known: tuple[str, ...] | type[StrEnum] = ()

    def read(self, arrays: Arrays, record: str, name: str) -> list[Any]:
        words = arrays.words(name, self.shape(arrays, record), tuple(self.known))
        return words if isinstance(self.known, tuple) else [self.known(word) for word in words]


@dataclasses.dataclass(frozen=True)
class ByName(Field):
    """A number by name for each record; NaN where a record has none. The names of all records are a coordinate."""

    noun: ClassVar[str] = "dict of str to float"

    what: str = ""  # is named
    low: float = -np.inf
    known: tuple[str, ...] = ()  # all names, if they are the same for records of every kind

    def variables(self, record: str, name: str, values: Sequence[Any]) -> Iterator[tuple[str, Variable]]:
        dimension = self._dimension(record)
        names = self.known or tuple(dict.fromkeys(key for value in values for key in value))
        rows = np.array([[value.get(key, np.nan) for key in names] for value in values], dtype=float)
        yield dimension, ((dimension,), np.array(names, dtype=str), {"long_name": f"name of the {self.what}"})
        yield name, ((record, dimension), rows.reshape(len(values), len(names)), _about(self.long_name, self.units))

    def read(self, arrays: Arrays, record: str, name: str) -> list[Any]:
        dimension = self._dimension(record)
        names = self.known or tuple(arrays.words(dimension, (arrays.size(dimension),)))
        rows = arrays.numbers(name, (arrays.size(record), len(names)), self.low, finite=False)
        return [{key: float(n) for key, n in zip(names, row, strict=True) if not np.isnan(n)} for row in rows]

    def _dimension(self, record: str) -> str:
        return self.what if self.known else f"{record}_{self.what}"


@dataclasses.dataclass(frozen=True)
class Length:
    """A length that differs from record to record; ragged arrays lie end to end and are not padded."""

    dimension: str  # the name of the record goes before it
    what: str  # is counted, in the plural
    ragged: bool = False

    def counts(self, record: str, lengths: Sequence[int]) -> tuple[str, Variable]:
        """Return the array of lengths, with its name."""
        dimension = f"{record}_{self.dimension}"
        attributes = _about(f"number of {self.what}") | ({"sample_dimension": dimension} if self.ragged else {})
        return f"{dimension}_count", ((record,), np.array(lengths, dtype=np.int64), attributes)

    def lay(self, record: str, pieces: Sequence[NDArray[Any]]) -> tuple[tuple[str, ...], Array]:
        """Return the dimensions and the values of one array that holds all the pieces."""
        dimension = f"{record}_{self.dimension}"
        if self.ragged:
            return (dimension,), np.concatenate([np.empty(0), *pieces])
        padded = np.full((len(pieces), max(map(len, pieces), default=0)), np.nan)
        for row, piece in zip(padded, pieces, strict=True):
            row[: len(piece)] = piece
        return (record, dimension), padded

    def take(self, arrays: Arrays, record: str, name: str, *, finite: bool) -> list[Array]:
        """Return the pieces of an array."""
        count, room = arrays.size(record), arrays.size(f"{record}_{self.dimension}")
        lengths = arrays.wholes(f"{record}_{self.dimension}_count", (count,), 0, room)
        if self.ragged:
            values = arrays.numbers(name, (int(lengths.sum()),), finite=False)
            pieces = np.split(values, np.cumsum(lengths)[:-1])[:count]
        else:
            rows = arrays.numbers(name, (count, room), finite=False)
            pieces = [row[:length] for row, length in zip(rows, lengths, strict=True)]
        if finite and not all(np.isfinite(piece).all() for piece in pieces):
            raise ResultFileError(f"its array {name!r} holds NaN or infinity where finite numbers are needed")
        return [piece.copy() for piece in pieces]


@dataclasses.dataclass(frozen=True)
class Series(Field):
    """An array of finite numbers; with `low`, of whole ones from that on, which may be listed as a tuple."""

    noun: ClassVar[str] = "array (count,)"

    length: Length = dataclasses.field(kw_only=True)
    low: int | None = None
    listed: bool = False

    def variables(self, record: str, name: str, values: Sequence[Any]) -> Iterator[tuple[str, Variable]]:
        pieces = [np.asarray(value, dtype=float) for value in values]
        yield self.length.counts(record, [len(piece) for piece in pieces])
        yield name, (*self.length.lay(record, pieces), _about(self.long_name, self.units))

    def read(self, arrays: Arrays, record: str, name: str) -> list[Any]:
        pieces = self.length.take(arrays, record, name, finite=True)
        if self.low is None:
            return pieces
        for piece in pieces:
            if not np.all((piece == np.floor(piece)) & (piece >= self.low) & (piece <= LARGEST_WHOLE)):
                raise ResultFileError(f"its array {name!r} holds numbers that are not whole, or below {self.low}")
        return [tuple(map(int, piece)) if self.listed else piece.astype(np.int64) for piece in pieces]


class Column(NamedTuple):
    """One column of an array of vectors: the end of its name, its long name, its units."""

    name: str
    long_name: str
    units: str = "1"

    @property
    def about(self) -> dict[str, Any]:
        """Attributes of the array."""
        return _about(self.long_name, self.units)


class Columns(NamedTuple):
    """The columns that all vectors have, and those of extra noise states, which are numbered."""

    first: tuple[Column, ...]
    further: Column | None = None

    def of(self, width: int) -> list[Column]:
        """Return the columns of vectors with so many entries; fewer if there are none for the others."""
        if self.further is None:
            return list(self.first[:width])
        name, long_name, units = self.further
        numbers = range(len(self.first) + 1, width + 1)
        return [*self.first[:width], *(Column(f"{name}{n}", f"{long_name} {n}", units) for n in numbers)]


PLANE = Columns((Column("x", "displacement", "m"), Column("v", "velocity", "m s-1")))
STATE = Columns(PLANE.first, Column("state", "state of the noise"))


@dataclasses.dataclass(frozen=True)
class Vectors(Field):
    """An array (length, n) of finite vectors, each column an array of its own."""

    noun: ClassVar[str] = "array (count, n)"

    length: Length = dataclasses.field(kw_only=True)
    columns: Columns = dataclasses.field(kw_only=True)
    prefixed: bool = True  # whether the names of the arrays contain that of the attribute
    finite: bool = True  # neither NaN nor infinity

    def variables(self, record: str, name: str, values: Sequence[Any]) -> Iterator[tuple[str, Variable]]:
        yield self.length.counts(record, [len(value) for value in values])
        least = len(self.columns.first)
        widths = {value.shape[1] for value in values if len(value)} or {least}
        columns = self.columns.of(max(widths))
        if len(widths) > 1 or not least <= max(widths) == len(columns):
            raise ResultFileError(f"{name} have {sorted(widths)} columns, which a file cannot hold")
        for index, column in enumerate(columns):
            pieces = [value[:, index] if len(value) else np.empty(0) for value in values]
            yield self._name(record, name, column), (*self.length.lay(record, pieces), column.about)

    def read(self, arrays: Arrays, record: str, name: str) -> list[Any]:
        names = [self._name(record, name, column) for column in self.columns.of(len(arrays.dataset.variables))]
        least = len(self.columns.first)
        present = names[:least] + list(itertools.takewhile(arrays.__contains__, names[least:]))
        columns = [self.length.take(arrays, record, column, finite=self.finite) for column in present]
        return [np.stack(piece, axis=1) for piece in zip(*columns, strict=True)]

    def _name(self, record: str, name: str, column: Column) -> str:
        return f"{name if self.prefixed else record}_{column.name}"


@dataclasses.dataclass(frozen=True)
class Spectrum(Field):
    """An array of complex numbers, real and imaginary parts apart; `finite`: neither NaN nor infinity."""

    noun: ClassVar[str] = "complex array (count,)"

    length: Length = dataclasses.field(kw_only=True)
    finite: bool = True

    @property
    def _parts(self) -> Vectors:
        parts = (Column(part[:4], f"{self.long_name}, {part} part", self.units) for part in ("real", "imaginary"))
        return Vectors("", length=self.length, columns=Columns(tuple(parts)), finite=self.finite)

    def variables(self, record: str, name: str, values: Sequence[Any]) -> Iterator[tuple[str, Variable]]:
        yield from self._parts.variables(record, name, [np.stack([one.real, one.imag], axis=1) for one in values])

    def read(self, arrays: Arrays, record: str, name: str) -> list[Any]:
        return [np.ascontiguousarray(pair).view(complex)[:, 0] for pair in self._parts.read(arrays, record, name)]
