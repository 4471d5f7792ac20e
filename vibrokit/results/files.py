"""Opens saved records: alone, inside another record, and of a kind that no installed package registers."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self

import xarray

from vibrokit.arguments import path_of
from vibrokit.construction import called
from vibrokit.errors import NoSuchFileError, ResultFileError, UnknownNameError, counted, nearest_form, reason, shown
from vibrokit.registry import Group, load
from vibrokit.results.arrays import Arrays, taken
from vibrokit.results.codes import Code
from vibrokit.results.energy import ActivationEnergy, read_energies
from vibrokit.results.finding import Finding
from vibrokit.results.netcdf import arrays_in, opened
from vibrokit.results.provenance import FORMAT, json_data, json_text, provenance_from
from vibrokit.results.record import Record, Summary

__all__ = ["ResultFileError", "load_result", "record_from"]


class PlainRecord(Record):
    """The arrays and the provenance of a file whose kind is unknown here."""

    kind: ClassVar[str] = "plain"

    dataset: Annotated[xarray.Dataset, "the arrays"]
    unknown_kind: Annotated[str, "the kind that the file names"]
    content: Annotated[bytes, "of the file, saved again as it is; empty for a part of another record"] = b""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the attractors, if the file has them in the usual place."""
        try:
            return tuple(Arrays(self.dataset).words("attractor_name", (None,)))
        except ResultFileError:
            return ()

    @property
    def energies(self) -> tuple[ActivationEnergy, ...]:
        """Activation energies, if the file has them in the usual place."""
        try:
            return read_energies(Arrays(self.dataset), len(self.names))[0]
        except ResultFileError:
            return ()

    @called
    def plot(self, ax: Any = None) -> Any:
        """Raise UnknownNameError: only the package that registers the kind can draw it."""
        raise UnknownNameError(
            f"there is no picture of kind {self.unknown_kind!r}: no installed package registers it; install the "
            "package that wrote the file, or draw the arrays in its dataset."
        )

    def to_dataset(self) -> xarray.Dataset:
        """Return the arrays."""
        return self.dataset

    @property
    def provenance(self) -> dict[str, Any]:
        """Provenance as plain data, with the kind that the file names."""
        return super().provenance | {"kind": self.unknown_kind}

    def _content(self) -> bytes:
        return self.content or super()._content()

    @classmethod
    def from_dataset(
        cls, dataset: xarray.Dataset, *, unknown_kind: str = "", findings: tuple[Finding, ...] = (), **provenance: Any
    ) -> Self:
        """Make a record of arrays, of the name of their kind, and of the content of their file."""
        unknown = Finding.of(Code.UNKNOWN_KIND, kind=unknown_kind)
        known = findings if unknown in findings else (*findings, unknown)
        return cls(dataset=dataset, unknown_kind=unknown_kind, findings=known, **provenance)

    @property
    def summary(self) -> Summary:
        """The unknown kind and the arrays."""
        arrays = [(str(name), " × ".join(map(str, array.shape))) for name, array in self.dataset.data_vars.items()]
        title = f"PlainRecord of unknown kind {self.unknown_kind!r}: {counted(len(arrays), 'array')}"
        return Summary(title, tuple(arrays))


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


_CONTENTS = "records"  # attribute: names of the records, in the order of their prefixes


def nested(records: Mapping[str, Record]) -> xarray.Dataset:
    """Return the arrays of several records, by name, as one dataset; raises ResultFileError."""
    whole = xarray.Dataset(attrs={_CONTENTS: json_text(list(records))})
    for number, record in enumerate(records.values()):
        own = record.to_dataset()
        if own.attrs:
            raise ResultFileError(f"a {type(record).__name__} with attributes of its own cannot be part of a record")
        prefixed = own.rename({name: f"r{number}_{name}" for name in {*own.variables, *own.dims}})
        whole = whole.assign(prefixed.data_vars).assign_coords(prefixed.coords)
        whole.attrs[f"r{number}_provenance"] = json_text(record.provenance)
    return whole


def records_in(dataset: xarray.Dataset) -> dict[str, Record]:
    """Return the records that `nested` put together; raises ResultFileError."""
    names = json_data(dataset.attrs.get(_CONTENTS))
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise ResultFileError(f"its records are {shown(names)}, and a list of names is needed")
    found = {}
    for number, name in enumerate(names):
        prefix = f"r{number}_"
        own = dataset[[one for one in dataset.variables if str(one).startswith(prefix)]]
        own = own.rename({one: str(one).removeprefix(prefix) for one in {*own.variables, *own.dims}})
        own.attrs = {}
        found[name] = record_from(own, json_data(dataset.attrs.get(f"{prefix}provenance")))
    return found
