"""Blocks: the pieces that a report is made of."""

from __future__ import annotations

import csv
import dataclasses
import io
from typing import ClassVar

from vibrokit.text_table import text_table


@dataclasses.dataclass(frozen=True)
class Table:
    """Rows of text under headings."""

    kind: ClassVar[str] = "table"

    name: str  # of its file
    title: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    detail: bool = False  # whether it is left out of a brief text

    @property
    def lines(self) -> list[str]:
        """The headings, then one line for each row, with columns of equal width."""
        return text_table([self.header, *self.rows])

    @property
    def text(self) -> str:
        """The title and the lines; nothing if there is no row."""
        return "\n".join([f"{self.title}:", *self.lines]) if self.rows else ""

    @property
    def csv(self) -> str:
        """The headings and the rows as comma-separated values."""
        lines = io.StringIO()
        csv.writer(lines, lineterminator="\n").writerows([self.header, *self.rows])
        return lines.getvalue()


@dataclasses.dataclass(frozen=True)
class Sentences:
    """Sentences, each a paragraph or an entry of a list."""

    kind: ClassVar[str] = "sentences"

    lines: tuple[str, ...]
    listed: bool = False
    detail: bool = False

    @property
    def text(self) -> str:
        """A line for each sentence."""
        return "\n".join(self.lines)


@dataclasses.dataclass(frozen=True)
class Listing:
    """Text whose line breaks and columns matter, such as a scene file."""

    kind: ClassVar[str] = "listing"

    title: str
    text: str
    detail: bool = False


@dataclasses.dataclass(frozen=True)
class Picture:
    """A drawing as SVG, and what it shows."""

    kind: ClassVar[str] = "picture"

    svg: str
    caption: str


@dataclasses.dataclass(frozen=True)
class Formulas:
    """Equations as MathML."""

    kind: ClassVar[str] = "formulas"

    mathml: tuple[str, ...]


Block = Table | Sentences | Listing
"""What stands in a report as text, too."""


@dataclasses.dataclass(frozen=True)
class Chapter:
    """A heading and what stands under it."""

    title: str
    blocks: tuple[Block | Picture | Formulas, ...]
