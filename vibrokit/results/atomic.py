"""Writes files whole or not at all."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path


def write_atomically(path: Path, content: bytes) -> None:
    """Write a file so that at any moment it is the old one or the whole new one."""
    if not path.parent.is_dir():
        raise FileNotFoundError(f"{path} would be in {path.parent}, which is no folder; make it first.")
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
