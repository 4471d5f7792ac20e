"""PlainRecord: a saved record whose kind no installed package registers."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Self

import xarray

from vibrokit.construction import called
from vibrokit.errors import ResultFileError, UnknownNameError, counted
from vibrokit.results.arrays import Arrays
from vibrokit.results.codes import Code
from vibrokit.results.energy import ActivationEnergy, read_energies
from vibrokit.results.finding import Finding
from vibrokit.results.record import Record
from vibrokit.results.summary import Summary


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
