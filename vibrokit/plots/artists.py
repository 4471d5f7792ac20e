"""Artists: what a picture consists of, and a picture as SVG that stands inside a page."""

from __future__ import annotations

import dataclasses
import io
from collections.abc import Sequence
from typing import Any, cast

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.mathtext import MathTextParser
from matplotlib.text import Text


@dataclasses.dataclass(frozen=True, eq=False)
class Artists:
    """The artists of one picture, to change or to save. Each picture has a subclass with a field for each part.

    Attributes
    ----------
    ax : matplotlib.axes.Axes
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


_STYLE: dict[Any, Any] = {
    "svg.fonttype": "path",  # a page may have no font of the same widths
    "svg.hashsalt": "vibrokit",  # the same picture gives the same bytes
}


def inline_svg(artists: Artists, name: str) -> str:
    """Return a picture as an element ``svg``.

    Parameters
    ----------
    artists : Artists
    name : str
        Begins the identifiers of the picture, so that they differ from those of the page's other pictures.
    """
    content = io.StringIO()
    with matplotlib.rc_context(_STYLE):
        metadata = {"Date": None, "Creator": None}
        artists.printable.savefig(content, format="svg", metadata=metadata, bbox_inches="tight")
    svg = content.getvalue()
    svg = svg[svg.index("<svg") :]
    for mark in ('id="', 'xlink:href="#', "url(#"):
        svg = svg.replace(mark, f"{mark}{name}-")
    return svg
