"""Summary: how a record shows itself, in a few lines of text or as a table in a notebook."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from html import escape
from typing import Annotated

from vibrokit.documented import documented
from vibrokit.results.codes import Severity
from vibrokit.results.finding import Finding, together

_ROWS = 3  # with the title and a finding, five lines
_WIDTH = 160


@documented
@dataclasses.dataclass(frozen=True)
class Summary:
    """A title and a table."""

    title: Annotated[str, "the title"]
    rows: Annotated[tuple[tuple[str, ...], ...], "the first cell of each row is its name"] = ()

    def text(self, findings: Sequence[Finding], names: Sequence[str]) -> str:
        """Return at most five lines: the title, the first rows, the first warning or error."""
        lines = [self.title, *(f"  {row[0]}: {', '.join(row[1:])}" for row in self.rows[:_ROWS])]
        if len(self.rows) > _ROWS:
            lines[-1] += f" … and {len(self.rows) - _ROWS} more"
        serious = [finding for finding in together(findings) if finding.severity is not Severity.INFO]
        lines += [f"  {one.severity}: {' '.join(one.sentence(names).split())}" for one in serious[:1]]
        return "\n".join(line if len(line) <= _WIDTH else f"{line[:_WIDTH]}…" for line in lines)

    def html(self, findings: Sequence[Finding], names: Sequence[str]) -> str:
        """Return the title, the table and all findings as HTML."""
        body = "".join(f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in row)}</tr>" for row in self.rows)
        table = f"<table>{body}</table>" if body else ""
        items = "".join(f"<li>{one.severity}: {escape(one.sentence(names))}</li>" for one in together(findings))
        return f"<p><b>{escape(self.title)}</b></p>{table}{f'<ul>{items}</ul>' if items else ''}"
