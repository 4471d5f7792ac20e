"""Inventories of other manuals for sphinx.ext.intersphinx, from inventories.toml and without a network."""

from __future__ import annotations

import tomllib
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

FOLDER = Path("_build/inventories")
"""Where the inventories are written, below the folder of the manual."""


def write_inventories(docs: Path) -> dict[str, tuple[str, str]]:
    """Write an inventory of each project in inventories.toml; return the mapping that intersphinx takes.

    Parameters
    ----------
    docs : Path
        Folder of the manual, which has inventories.toml.

    Returns
    -------
    dict of str to (str, str)
        By project: the address of its manual, and the file of its inventory below `docs`.
    """
    projects = tomllib.loads(docs.joinpath("inventories.toml").read_text(encoding="utf-8"))
    docs.joinpath(FOLDER).mkdir(parents=True, exist_ok=True)
    mapping = {}
    for project, tables in projects.items():
        file = FOLDER / f"{project}.inv"
        docs.joinpath(file).write_bytes(inventory(project, tables))
        mapping[project] = (tables["url"], file.as_posix())
    return mapping


def inventory(project: str, tables: Mapping[str, Any]) -> bytes:
    """Return the content of an inventory, in version 2 of Sphinx's format.

    Parameters
    ----------
    project : str
    tables : mapping
        The places of objects by role and name, and `url`, which is left out.
    """
    head = f"# Sphinx inventory version 2\n# Project: {project}\n# Version: \n"
    head += "# The remainder of this file is compressed using zlib.\n"
    objects = ((role, *entry) for role, table in tables.items() if role != "url" for entry in table.items())
    lines = [f"{name} py:{role} 1 {place} -\n" for role, name, place in objects]
    return head.encode() + zlib.compress("".join(lines).encode())
