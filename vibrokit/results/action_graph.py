"""Result of an action graph."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

from vibrokit.construction import called
from vibrokit.results.result import Result

if TYPE_CHECKING:
    from vibrokit.plots.quasi_potential import QuasiPotentialArtists


class ActionGraphResult(Result):
    """Quasi-potentials on the section, attractor by attractor.

    `branches` has the energy of each place where paths may end. `data` has, along ``source``:

    - ``quasi_potential`` over (``node_x``, ``node_v``), NaN where it was not computed, with coordinates
      ``quasi_potential_x`` and ``quasi_potential_v`` of the nodes, which differ from source to source;
    - ``graph_path_t``, ``graph_path_x`` and ``graph_path_v`` over ``graph_step``: the graph's path to the cheapest
      exit, its last state beyond it; NaN if none was traced.
    """

    kind: ClassVar[str] = "action_graph"
    refined_by: ClassVar[str] = "raise nodes"

    @called
    def plot(self, ax: Any = None, source: int | str | None = None) -> QuasiPotentialArtists:
        """Draw a quasi-potential; see `Result.plot_quasi_potential`."""
        return self.plot_quasi_potential(source, ax)
