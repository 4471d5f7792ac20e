"""Tables: the attributes of records as arrays of a dataset, declared once and used to write and to read."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from vibrokit.errors import ResultFileError
from vibrokit.results.arrays import Arrays
from vibrokit.results.fields import Field, Variable


@dataclasses.dataclass(frozen=True)
class Table:
    """Records of one kind."""

    record: str  # name of their dimension, which also goes before the name of each array
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
        return self.record if attribute == self.index else f"{self.record}_{attribute}"
