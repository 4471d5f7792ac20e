"""Result of the search for the least action."""

from __future__ import annotations

import dataclasses
import re
from typing import Any, ClassVar

from vibrokit.errors import StructureError
from vibrokit.results.columns import Draft
from vibrokit.results.content import Content
from vibrokit.results.energy import ActivationEnergy
from vibrokit.results.energy_file import BRANCHES
from vibrokit.results.path_pictures import plot_exit_paths, plot_histories, with_paths
from vibrokit.results.result import Result
from vibrokit.results.section import Section
from vibrokit.results.transitions import Transitions
from vibrokit.results.transitions_file import read_transitions, write_transitions

_POTENTIAL = re.compile(r"quasi_potential_(\d+)")
_SHOWN = 1.5  # times the largest energy: what lies beyond the exits needs no shades


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class LeastActionResult(Result):
    """Exit paths of least action, and the energies that they cost.

    `energies` has the best path from each attractor to each other. `data` has the section as `Section.data` lays it
    out (basins, points of attractors and saddles, stable manifolds) and, where they were computed, the
    quasi-potentials ``quasi_potential_k`` of the attractors on the cells of the region.

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
        """Draw the quasi-potential of an attractor; see `vibrokit.plots.quasi_potential.quasi_potential_map`.

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
        from vibrokit.plots.quasi_potential import quasi_potential_map

        known = _potentials(self.data.variables)
        label = source if source is not None else min(known, default=None)
        if label not in known:
            there_are = f"; there are those of {', '.join(map(str, sorted(known)))}" if known else ""
            raise StructureError(f"the result has no quasi-potential of attractor {label}{there_are}.")
        section = Section.in_data(self.data)
        own = [energy for energy in self.energies if energy.source == label]
        return quasi_potential_map(
            self.data[known[label]].values,
            section.bounds,
            section.points[label],
            label=label,
            top=_SHOWN * max(energy.value for energy in own) if own else None,
            saddles=section.saddles,
            paths=[path.q[path.section] for _, path in with_paths(own)],
            ax=ax,
        )

    def write_extras(self, draft: Draft) -> None:
        """Put branches and transitions into a file in the making."""
        BRANCHES.write(draft, self.branches)
        if self.transitions is not None:
            write_transitions(draft, self.transitions)

    @classmethod
    def read_extras(cls, content: Content) -> dict[str, Any]:
        """Return branches and transitions; raises ResultFileError, also where the section is none."""
        Section.in_data(content.dataset)
        for name in _potentials(content.dataset.variables).values():
            content.numbers(name, (None, None), finite=False)
        return {"branches": BRANCHES.read(content), "transitions": read_transitions(content)}


def _potentials(names: Any) -> dict[int, str]:
    """Names of the quasi-potentials by the attractor's label."""
    matches = (_POTENTIAL.fullmatch(str(name)) for name in names)
    return {int(match[1]): match[0] for match in matches if match}
