"""Result of the search for the least action."""

from __future__ import annotations

import dataclasses
from typing import Any, ClassVar

from vibrokit.results.columns import Draft
from vibrokit.results.content import Content
from vibrokit.results.energy import ActivationEnergy
from vibrokit.results.energy_file import BRANCHES
from vibrokit.results.path_pictures import plot_exit_paths, plot_histories
from vibrokit.results.quasi_potential import QuasiPotential, plot_quasi_potential
from vibrokit.results.result import Result
from vibrokit.results.section import Section
from vibrokit.results.transitions import Transitions
from vibrokit.results.transitions_file import read_transitions, write_transitions


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class LeastActionResult(Result):
    """Exit paths of least action, and the energies that they cost.

    `energies` has the best path from each attractor to each other. `data` has the section as `Section.data` lays it
    out (basins, points of attractors and saddles, stable manifolds) and, where they were computed, the
    quasi-potentials of the attractors as `QuasiPotential` has them.

    Attributes
    ----------
    branches : tuple of ActivationEnergy
        All extremal paths that were polished, also those that are not the best.
    transitions : Transitions or None
        Between all attractors; None where it is not another basin that is left for.
    """

    kind: ClassVar[str] = "least_action"

    branches: tuple[ActivationEnergy, ...] = ()
    transitions: Transitions | None = None

    def plot(self, ax: Any = None) -> Any:
        """Draw the exit paths over basins and manifolds; see `vibrokit.plots.exit_paths.exit_paths`."""
        return plot_exit_paths(self.data, self.energies, ax)

    def plot_history(self, ax: Any = None) -> Any:
        """Draw p₂ and S along each path; see `vibrokit.plots.exit_paths.path_history`.

        Raises
        ------
        StructureError
            No energy has a path.
        """
        return plot_histories(self.energies, ax)

    def plot_quasi_potential(self, source: int | None = None, ax: Any = None) -> Any:
        """Draw the quasi-potential of an attractor; see `vibrokit.results.quasi_potential.plot_quasi_potential`.

        Parameters
        ----------
        source : int, optional
            Label of the attractor; by default the first that has one.
        ax : matplotlib Axes, optional

        Raises
        ------
        StructureError
            It was not computed for this attractor, or for none.
        """
        return plot_quasi_potential(self.data, self.energies, source, ax)

    def write_extras(self, draft: Draft) -> None:
        """Put branches and transitions into a file in the making."""
        BRANCHES.write(draft, self.branches)
        if self.transitions is not None:
            write_transitions(draft, self.transitions)

    @classmethod
    def read_extras(cls, content: Content) -> dict[str, Any]:
        """Return branches and transitions; raises ResultFileError, also where the section is none."""
        Section.in_data(content.dataset)
        QuasiPotential.all_in(content.dataset)
        return {"branches": BRANCHES.read(content), "transitions": read_transitions(content)}
