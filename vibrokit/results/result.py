"""Result: what an analyzer returns, and what is saved of it."""

from __future__ import annotations

import dataclasses
import os
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar

from vibrokit.results.energy import ActivationEnergy

if TYPE_CHECKING:
    import xarray

    from vibrokit.results.columns import Draft
    from vibrokit.results.content import Content


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Result(ABC):
    """A record of one analysis. Abstract; each analyzer has its own, which knows how to draw itself.

    Attributes
    ----------
    energies : tuple of ActivationEnergy
    data : xarray.Dataset
        Labelled arrays behind the numbers.
    scene : dict
        The scene as plain data, with every parameter.
    settings : dict
        Configuration of the analyzer.
    status : str
        What was found and what was not, as sentences, a line for each matter.
    seconds : float
        Time that it took.
    versions : dict
        Versions of the toolkit and of what it stands on.
    seed : int or None
        Seed of what was random.

    For developers
    --------------
    A subclass names its `kind`, which files carry, and writes `plot`. From these everything else just works: saving,
    opening, and drawing without what made it. One with attributes of its own also writes `write_extras` and
    `read_extras`.
    """

    kind: ClassVar[str]

    energies: tuple[ActivationEnergy, ...]
    data: xarray.Dataset
    scene: Mapping[str, Any]
    settings: Mapping[str, Any]
    status: str
    seconds: float
    versions: Mapping[str, str]
    seed: int | None = None

    def __repr__(self) -> str:
        energies = ", ".join(f"{e.exit}: {e.value:.6g}" for e in self.energies)
        return f"<{type(self).__name__}: ΔU {energies or 'none'}. {' '.join(self.status.splitlines())}>"

    @abstractmethod
    def plot(self, ax: Any = None) -> Any:
        """Draw the picture of this result into `ax`, or into a new figure; return the artists."""

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write to a netCDF file, whole or not at all; `vibrokit.load_result` opens it."""
        from vibrokit.results.writing import save_result

        save_result(self, path)

    def write_extras(self, draft: Draft) -> None:  # noqa: B027 (most results have nothing to add)
        """Put what this kind of result has besides into a file in the making; nothing here."""

    @classmethod
    def read_extras(cls, content: Content) -> dict[str, Any]:
        """Return, by name, what `write_extras` wrote, and check the arrays that pictures are drawn of.

        Raises
        ------
        ResultFileError
            Something is missing, of another shape or kind, or contradicts the rest.
        """
        return {}
