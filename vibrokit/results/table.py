"""Tables: the attributes of records as arrays of a dataset, declared once and used to write, to read and to describe.

``period: Annotated[int, "period in forcing periods"]`` declares an attribute: these words describe it in files and in
the docstring of its class, by `vibrokit.documented`. ``Annotated[float, "time after which it repeats", "s"]`` has a
unit; where more is to be said, `Annotated` takes a field.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from enum import StrEnum
from typing import Any, get_type_hints

import numpy as np

from vibrokit.errors import ResultFileError
from vibrokit.results.arrays import Arrays
from vibrokit.results.fields import Field, Flag, Number, Scalar, Variable, Whole, Word


@dataclasses.dataclass(frozen=True)
class Table:
    """Records of one kind."""

    record: str  # name of their dimension, which also goes before the name of each array; empty for a single record
    fields: Mapping[str, Field]  # by attribute
    index: str = ""  # attribute that is the coordinate of the dimension

    def variables(self, records: Sequence[Any], **columns: Sequence[Any]) -> dict[str, Variable]:
        """Return the arrays that hold all records; `columns` has the fields that are not attributes of the records."""
        found: dict[str, Variable] = {}
        for attribute, field in self.fields.items():
            values = columns[attribute] if attribute in columns else [getattr(one, attribute) for one in records]
            for name, variable in field.variables(self.record, self._name(attribute), values):
                known = found.setdefault(name, variable)  # two fields of one length have the same lengths
                if known is not variable and not np.array_equal(known[1], variable[1]):
                    raise ResultFileError(f"a {self.record} has arrays of different lengths where one is needed")
        return found

    def read(self, arrays: Arrays) -> list[dict[str, Any]]:
        """Return the values of each record by attribute; raises ResultFileError."""
        columns = [field.read(arrays, self.record, self._name(name)) for name, field in self.fields.items()]
        return [dict(zip(self.fields, values, strict=True)) for values in zip(*columns, strict=True)]

    def _name(self, attribute: str) -> str:
        return self.record if attribute == self.index else f"{self.record}_{attribute}".lstrip("_")


@dataclasses.dataclass(frozen=True)
class Part(Field):
    """A dataclass of numbers, or None: each of its attributes is an array, and a flag tells which there are."""

    units: str = ""
    kind: type[Any] = dataclasses.field(kw_only=True)
    flag: str = dataclasses.field(kw_only=True)

    def variables(self, record: str, name: str, values: Sequence[Any]) -> Iterator[tuple[str, Variable]]:
        known = [value is not None for value in values]
        yield from Flag(f"whether there is {self.long_name}").variables(record, f"{record}_{self.flag}", known)
        for attribute, field in fields_of(self.kind).items():
            own = [np.nan if value is None else getattr(value, attribute) for value in values]
            yield from field.variables(record, f"{name}_{attribute}", own)

    def read(self, arrays: Arrays, record: str, name: str) -> list[Any]:
        fields = fields_of(self.kind)
        known = Flag("").read(arrays, record, f"{record}_{self.flag}")
        columns = [field.read(arrays, record, f"{name}_{own}") for own, field in fields.items()]
        rows = (self.kind(**dict(zip(fields, row, strict=True))) for row in zip(*columns, strict=True))
        return [row if has else None for has, row in zip(known, rows, strict=True)]


_BY_TYPE: dict[Any, type[Scalar]] = {float: Number, int: Whole, bool: Flag, str: Word}


def fields_of(kind: type) -> dict[str, Field]:
    """Return the fields that the annotations of a dataclass declare, by attribute."""
    found: dict[str, Field] = {}
    for name, hint in get_type_hints(kind, include_extras=True).items():
        said: tuple[Any, ...] = getattr(hint, "__metadata__", ())
        own = hint.__origin__ if said else None
        if said and isinstance(said[0], Field):
            found[name] = said[0]
        elif own in _BY_TYPE:
            found[name] = _BY_TYPE[own](*said)
        elif isinstance(own, type) and issubclass(own, StrEnum):
            found[name] = Word(said[0], known=own)
    return found
