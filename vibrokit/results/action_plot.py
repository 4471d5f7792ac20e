"""Result of an action plot."""

from __future__ import annotations

import dataclasses
from typing import Any, ClassVar

from vibrokit.errors import StructureError
from vibrokit.results.content import Content
from vibrokit.results.path_pictures import plot_exit_paths
from vibrokit.results.result import Result
from vibrokit.results.section import Section


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class ActionPlotResult(Result):
    """Actions of exits against the angle and the radius at which they started, attractor by attractor.

    `data` has, for the attractor of label k and every start:

    - ``angle_k``, in the plane where Σ is a circle (on the ring, in the plane of m and m s⁻¹);
    - ``radius_k``, how far from the inner to the outer edge of the fundamental domain, from 0 to 1 on a logarithmic
      scale; 0 on the ring;
    - ``polar_k``, further angles, where noise has states of its own;
    - ``action_k``, at the exit, NaN where there was none; exits much dearer than the least are not confirmed;
    - ``status_k``, a constant of `vibrokit.kernels.stopping`; ``target_k``, the label of where the exit leads, −1 where
      that is not known; ``exit_x_k`` and ``exit_v_k``, where the path was when it ended;

    and the section as `Section.data` lays it out.
    """

    kind: ClassVar[str] = "action_plot"

    def plot(self, ax: Any = None) -> Any:
        """Draw action against angle; see `vibrokit.plots.actions.action_plot`."""
        from vibrokit.plots.actions import action_plot

        return action_plot(self.data, self.energies, ax=ax)

    def plot_domain(self, label: int, ax: Any = None) -> Any:
        """Draw action over angle and radius; see `vibrokit.plots.actions.action_map`.

        Parameters
        ----------
        label : int
            Of the attractor that is left.
        ax : matplotlib Axes, optional

        Raises
        ------
        StructureError
            Nothing was started from an attractor of that label.
        """
        from vibrokit.plots.actions import action_map

        if f"action_{label}" not in self.data:
            started = [str(name).removeprefix("action_") for name in self.data if str(name).startswith("action_")]
            raise StructureError(
                f"no path started from attractor {label!r}; some did from {', '.join(started) or 'none'}."
            )
        return action_map(self.data, label, ax=ax)

    def plot_paths(self, ax: Any = None) -> Any:
        """Draw the exit paths over basins and manifolds; see `vibrokit.plots.exit_paths.exit_paths`."""
        return plot_exit_paths(self.data, self.energies, ax)

    @classmethod
    def read_extras(cls, content: Content) -> dict[str, Any]:
        """Check what lies on the section; raises ResultFileError."""
        Section.in_data(content.dataset)
        return {}
