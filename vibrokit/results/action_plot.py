"""Result of an action plot."""

from __future__ import annotations

import dataclasses
from typing import Any, ClassVar

from vibrokit.results.result import Result


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class ActionPlotResult(Result):
    """Actions of exits against the angle at which they started, attractor by attractor.

    `data` has, for the attractor of label k: ``angle_k``, ``action_k`` (NaN where no exit was confirmed) and
    ``status_k`` of every start; and the basin grid with the attractors' points.
    """

    kind: ClassVar[str] = "action_plot"

    def plot(self, ax: Any = None) -> Any:
        """Draw action against angle; see `vibrokit.plots.actions.action_plot`."""
        from vibrokit.plots.actions import action_plot

        return action_plot(self.data, self.energies, ax=ax)

    def plot_paths(self, ax: Any = None) -> Any:
        """Draw the exit paths on the section, over the basins; see `vibrokit.plots.actions.exit_paths`."""
        from vibrokit.plots.actions import exit_paths

        return exit_paths(self.data, self.energies, ax=ax)
