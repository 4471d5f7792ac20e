"""Artists: what a picture consists of."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import cast

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.mathtext import MathTextParser
from matplotlib.text import Text


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

    @property
    def printable(self) -> Figure:
        """The figure; names with dollar signs that stand for no formula are shown as they are."""
        parser = MathTextParser("path")
        for text in cast(list[Text], self.figure.findobj(Text)):
            try:
                parser.parse(text.get_text())
            except ValueError:
                text.set_parse_math(False)
        return self.figure


def attractor_name(label: int, names: Sequence[str]) -> str:
    """Return what pictures call an attractor."""
    return names[label] if 0 <= label < len(names) else f"attractor {label}"
