"""Results of the search for the least action, and of its two parts: graph and action plot."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from vibrokit.construction import called
from vibrokit.errors import StructureError
from vibrokit.results.arrays import Arrays
from vibrokit.results.labels import source_among
from vibrokit.results.result import Result

if TYPE_CHECKING:
    from vibrokit.plots.actions import ActionMapArtists, ActionPlotArtists
    from vibrokit.plots.quasi_potential import QuasiPotentialArtists


class LeastActionResult(Result):
    """Exit paths of least action and their energies.

    `energies` has the best path of each exit, `branches` all polished paths. `data` has the quasi-potentials as in
    `ActionGraphResult`, where they were computed.
    """

    kind: ClassVar[str] = "least_action"
    refined_by: ClassVar[str] = "raise graph.nodes"


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


Starts = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]


class ActionPlotResult(Result):
    """Actions of exits against the angle and the radius at which they started, attractor by attractor.

    `data` has, along ``source`` and ``start``:

    - ``angle``, in the plane where Σ is a circle (on the ring, in the plane of m and m s⁻¹);
    - ``radius``, the distance from the inner to the outer edge of the fundamental domain, from 0 to 1 on a logarithmic
      scale; 0 on the ring;
    - ``polar``, further angles, where the noise has states;
    - ``action`` at the exit, NaN where there was none; exits that cost much more than the least are not confirmed;
    - ``exit_status``, a constant of `vibrokit.kernels.stopping`; ``target``, the label of the attractor that the exit
      leads to, −1 where that is not known; ``exit_x`` and ``exit_v``, where the path ended.
    """

    kind: ClassVar[str] = "action_plot"
    refined_by: ClassVar[str] = "raise points"

    @called
    def plot(self, ax: Any = None) -> ActionPlotArtists:
        """Draw action against angle; see `vibrokit.plots.actions.action_plot`."""
        from vibrokit.plots.actions import action_plot

        starts = self._starts()
        angles, radii, actions = zip(*starts.values(), strict=True) if starts else ((), (), ())
        return action_plot(
            angles,
            radii,
            actions,
            labels=list(starts),
            names=[self.names[label] for label in starts],
            energies=[(energy.source, energy.value) for energy in self.energies],
            ax=ax,
        )

    @called
    def plot_domain(self, source: int | str | None = None, ax: Any = None) -> ActionMapArtists:
        """Draw the action over the fundamental domain; see `vibrokit.plots.actions.action_map`.

        Parameters
        ----------
        source : int or str, optional
            Label or name of the attractor that is left; by default the first that was searched.
        ax : matplotlib.axes.Axes, optional

        Raises
        ------
        StructureError
            There is no search from this attractor, or from any.
        """
        from vibrokit.plots.actions import action_map

        starts = self._starts()
        if not starts:
            raise StructureError("the result has no starts; see its status.")
        label = source_among(starts, source, self.names, "starts", "from")
        return action_map(*starts[label], name=self.names[label], ax=ax)

    def _starts(self) -> dict[int, Starts]:
        """Angle, radius and action of the starts, by label of the attractor."""
        arrays = Arrays(self.data)
        if "angle" not in arrays:
            return {}
        labels = arrays.wholes("source", (None,), 0, len(self.names) - 1)
        shape, found = (len(labels), arrays.size("start")), {}
        columns = [arrays.numbers(name, shape, finite=False) for name in ("angle", "radius", "action")]
        for label, angle, radius, action in zip(labels.tolist(), *columns, strict=True):
            kept = np.isfinite(angle)  # shorter ones end in NaN
            found[label] = angle[kept], radius[kept], action[kept]
        return found
