"""Report: one page on the records of a scene, to hand on."""

from __future__ import annotations

import dataclasses
import os
import re
from pathlib import Path

import jinja2

from vibrokit.arguments import path_of
from vibrokit.construction import called
from vibrokit.errors import VibrokitError
from vibrokit.report.blocks import Chapter, Table
from vibrokit.report.chapters import chapters_of
from vibrokit.report.material import gathered
from vibrokit.results.atomic import made_folder, write_atomically
from vibrokit.results.record import Record

_PAGES = jinja2.Environment(
    loader=jinja2.PackageLoader("vibrokit.report", "templates"),
    autoescape=True,
    undefined=jinja2.StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
)
_ENDINGS = (".html", ".htm")


@dataclasses.dataclass(frozen=True)
class Report:
    """What the records of one scene say, as a page that needs nothing else: no script, no file, no network.

    Attributes
    ----------
    title : str
    complete : bool
        Whether all records are.
    chapters : tuple of Chapter
    """

    title: str
    complete: bool
    chapters: tuple[Chapter, ...]

    @classmethod
    @called
    def of(cls, *records: Record, title: str = "Vibro-impact oscillator") -> Report:
        """Make a report of records: an assessment, or a structure and results, or any record.

        Raises
        ------
        ArgumentError
            There is no record, or something is no record.
        StructureError
            The records are of different scenes, or of different steady states.
        """
        material = gathered(records)
        return cls(title, all(one.complete for one in material), chapters_of(material))

    @property
    def html(self) -> str:
        """The page."""
        return _PAGES.get_template("report.html").render(report=self)

    def _repr_html_(self) -> str:
        return self.html

    @property
    def tables(self) -> tuple[Table, ...]:
        """All tables that have a row, in the order of the page."""
        blocks = (block for chapter in self.chapters for block in chapter.blocks)
        return tuple(block for block in blocks if isinstance(block, Table) and block.rows)

    @called
    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the page, whole or not at all.

        Raises
        ------
        VibrokitError
            The name of the file does not end in .html.
        FileError
            The file cannot be written.
        """
        write_atomically(checked_page(path), self.html.encode("utf-8"))

    @called
    def save_tables(self, folder: str | os.PathLike[str]) -> tuple[Path, ...]:
        """Write each table as comma-separated values into a folder, which is made; return the files.

        Raises
        ------
        FileError
            The folder or a file cannot be written.
        """
        target, files = made_folder(folder), list[Path]()
        for chapter in self.chapters:
            for block in chapter.blocks:
                if isinstance(block, Table) and block.rows:
                    name = re.sub(r"[^a-z0-9]+", "-", f"{chapter.title}-{block.name}".lower()).strip("-")
                    files.append(target / f"{name}.csv")
                    write_atomically(files[-1], block.csv.encode("utf-8"))
        return tuple(files)


def checked_page(path: str | os.PathLike[str]) -> Path:
    """Return the path of a page; raises VibrokitError if its ending is not that of a page."""
    target = path_of(path)
    if target.suffix.lower() not in _ENDINGS:
        raise VibrokitError(f"{target} ends in {target.suffix!r}; a report ends in {' or '.join(_ENDINGS)}.")
    return target
