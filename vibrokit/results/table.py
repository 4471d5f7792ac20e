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
    """Records of one kind.

    Attributes
    ----------
    record : str
        Name of their dimension, which also goes before the name of each array.
    fields : dict of str to Field
        By attribute.
    index : str
        Attribute that is the coordinate of the dimension; empty if none is.
    """

    record: str
    fields: Mapping[str, Field]
    index: str = ""

    def variables(self, records: Sequence[Any], **columns: Sequence[Any]) -> dict[str, Variable]:
        """Return the arrays that hold all records.

        Parameters
        ----------
        records : sequence
        **columns : sequence
            Values of fields that are not attributes of the records.
        """
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


@dataclasses.dataclass(frozen=True)
class Single:
    """One record, each attribute a single number or text without a dimension."""

    fields: Mapping[str, Field]

    def variables(self, record: Any) -> dict[str, Variable]:
        """Return the arrays that hold the record."""
        found = Table(_ONE, self.fields).variables([record])
        return {name.removeprefix(f"{_ONE}_"): ((), values[0], about) for name, (_, values, about) in found.items()}

    def read(self, arrays: Arrays) -> dict[str, Any]:
        """Return the attributes; raises ResultFileError."""
        names = [name for name in self.fields if name in arrays]
        alone = Arrays(arrays.dataset[names].reset_coords(drop=True).expand_dims(_ONE))
        return {name: field.read(alone, _ONE, name)[0] for name, field in self.fields.items()}


_ONE = "one"
