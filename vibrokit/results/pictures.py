"""Saves pictures, whole or not at all."""

from __future__ import annotations

import io
import os
from pathlib import Path
from typing import TYPE_CHECKING

from vibrokit.arguments import path_of
from vibrokit.errors import VibrokitError
from vibrokit.results.atomic import write_atomically

if TYPE_CHECKING:
    from vibrokit.plots.artists import Artists

_DPI = 150
_FORMATS = (".png", ".pdf", ".svg")


def checked_picture(path: str | os.PathLike[str]) -> Path:
    """Return the path of a picture; raises VibrokitError if its ending is not that of a picture."""
    target = path_of(path)
    if target.suffix not in _FORMATS:
        raise VibrokitError(f"{target} ends in {target.suffix!r}; a picture ends in {', '.join(_FORMATS)}.")
    return target


def save_figure(artists: Artists, path: str | os.PathLike[str]) -> None:
    """Save the figure of a picture; the file's ending chooses the format. Raises VibrokitError for other endings."""
    target = checked_picture(path)
    content = io.BytesIO()
    artists.printable.savefig(content, format=target.suffix[1:], dpi=_DPI)
    write_atomically(target, content.getvalue())
