"""Writes files and pictures whole or not at all, into folders that it makes."""

from __future__ import annotations

import io
import os
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from vibrokit.arguments import path_of
from vibrokit.errors import FileError, NoSuchFileError, VibrokitError, reason

if TYPE_CHECKING:
    from vibrokit.plots.artists import Artists


def write_atomically(path: str | os.PathLike[str], content: bytes) -> None:
    """Write a file so that at any moment it is the old one or the whole new one; raises FileError."""
    target = checked_target(path)
    try:
        _write(target, content)
    except (OSError, ValueError) as error:
        raise FileError(
            f"{target} cannot be written ({reason(error)}); give a path in a folder that "
            "you may write to, on a disk that has room."
        ) from error


def checked_target(path: str | os.PathLike[str]) -> Path:
    """Return a path that a file can have; raises FileError before any work for it is done."""
    target = path_of(path)
    if not target.parent.is_dir():
        raise NoSuchFileError(f"{target} would be in {target.parent}, which is no folder; make it first.")
    if target.is_dir():
        raise FileError(f"{target} is a folder; add the name of a file.")
    if not os.access(target.parent, os.W_OK):
        raise FileError(f"{target} cannot be written, because you may not write to {target.parent}; choose another.")
    return target


def made_folder(path: str | os.PathLike[str]) -> Path:
    """Return a folder, made if it is missing; raises FileError unless files can be written there."""
    target = path_of(path)
    try:
        target.mkdir(exist_ok=True)
        tempfile.TemporaryFile(dir=target).close()  # permissions do not show a full disk, nor one that is read-only
    except (OSError, ValueError) as error:
        raise FileError(
            f"{target} cannot be a folder for results ({reason(error)}); give another one, on a disk that has room."
        ) from error
    return target


def _write(path: Path, content: bytes) -> None:
    with tempfile.NamedTemporaryFile("wb", dir=path.parent, prefix=f".{path.name}-", delete=False) as file:
        try:
            file.write(content)
            file.close()
            os.chmod(file.name, 0o666 & ~_umask())
            os.replace(file.name, path)
        except BaseException:
            Path(file.name).unlink(missing_ok=True)  # it is gone if the interrupt came after the replacement
            raise


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


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
    artists.printable.savefig(content, format=target.suffix[1:], dpi=150)
    write_atomically(target, content.getvalue())
