"""Result of an action graph."""

from __future__ import annotations

import dataclasses
from typing import Any, ClassVar

from vibrokit.results.content import Content
from vibrokit.results.quasi_potential import QuasiPotential, plot_quasi_potential
from vibrokit.results.result import Result
from vibrokit.results.section import Section


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class ActionGraphResult(Result):
    """Quasi-potentials on the section, attractor by attractor.

    `data` has the section as `Section.data` lays it out and, for the attractor of label k: ``quasi_potential_k`` as
    `QuasiPotential` has it (NaN beyond what was looked at); ``barrier_k``, rows of a saddle's place in the structure,
    its V, and how far that may be wrong; ``graph_path_k``, states of the cheapest path at equal steps of time.
    """

    kind: ClassVar[str] = "action_graph"

    def plot(self, ax: Any = None, label: int | None = None) -> Any:
        """Draw a quasi-potential on the section; see `vibrokit.results.quasi_potential.plot_quasi_potential`.

        Parameters
        ----------
        ax : matplotlib Axes, optional
        label : int, optional
            Of the attractor; by default the first that there is one for.

        Raises
        ------
        StructureError
            There is none for that attractor.
        """
        return plot_quasi_potential(self.data, self.energies, label, ax)

    @classmethod
    def read_extras(cls, content: Content) -> dict[str, Any]:
        """Check what is drawn; raises ResultFileError."""
        Section.in_data(content.dataset)
        QuasiPotential.all_in(content.dataset)
        return {}
