"""Pictures as SVG that stands inside a page."""

from __future__ import annotations

import io
from typing import Any

import matplotlib

from vibrokit.plots.artists import Artists

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
