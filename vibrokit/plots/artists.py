"""Artists: what a picture consists of."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import cast

from matplotlib.axes import Axes
from matplotlib.figure import Figure


@dataclasses.dataclass(frozen=True, eq=False)
class Artists:
    """The artists of one picture, to change or to save. Each picture has a subclass with a field for each part.

    Attributes
    ----------
    ax : matplotlib Axes
        Where it is drawn; the first one if the picture has several.
    """

    ax: Axes

    @property
    def figure(self) -> Figure:
        """The figure that the picture is in."""
        return cast(Figure, self.ax.get_figure(root=True))


def attractor_name(label: int, names: Sequence[str]) -> str:
    """Return what pictures call an attractor."""
    return names[label] if 0 <= label < len(names) else f"attractor {label}"
