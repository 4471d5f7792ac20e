"""reproduce: the paper, whole, into a folder."""

from __future__ import annotations

import math
import os
from pathlib import Path

from vibrokit.construction import called
from vibrokit.errors import VibrokitError
from vibrokit.plots.artists import inline_svg
from vibrokit.progress import Progress, put_off, working
from vibrokit.report.blocks import Chapter, Picture, Sentences, Table
from vibrokit.report.chapters import work_chapter
from vibrokit.report.report import Report
from vibrokit.reproduction.figures import Figure, figures
from vibrokit.reproduction.published import STATES
from vibrokit.reproduction.steps import Records, do, steps
from vibrokit.reproduction.verdicts import Match, Verdict, verdicts
from vibrokit.results.atomic import made_folder, save_figure
from vibrokit.text_table import number_text

PAGE = "reproduction.html"
PUBLISHED = "published"
"""Name of the table of published numbers."""


@called
def reproduce(
    folder: str | os.PathLike[str], *, quick: bool = False, progress: Progress = None, time_limit: float | None = None
) -> Report:
    """Compute the paper's numbers by all methods, draw its figures, and compare: a folder to look at.

    The folder gets each record (netCDF), each figure (PNG), the tables (CSV) and a page, ``reproduction.html``. Work
    that was stopped, or killed at any moment, goes on from the records that are there, with the same numbers to the
    last bit; records of other versions, settings or scenes are made again.

    Parameters
    ----------
    folder : str or path
        Is made if it is missing.
    quick : bool
        Coarser basins, fewer starts, nodes and exits.
    progress : bool or callable, optional
        As of `vibrokit.find_structure`.
    time_limit : float, optional
        In seconds; the report of what was reached is returned, marked incomplete.

    Returns
    -------
    Report

    Raises
    ------
    FileError
        The folder or a file cannot be written.
    """
    target, wanted = made_folder(folder), steps(quick=quick)
    with working(progress, time_limit):
        records = do(wanted, target)
        with put_off():
            report = _report(records, complete=sum(map(len, records.values())) == len(wanted), folder=target)
            report.save(target / PAGE)
            report.save_tables(target)
    return report


def _report(records: Records, *, complete: bool, folder: Path) -> Report:
    found = verdicts(records)
    met = sum(one.match is Match.MET for one in found)
    summary = (
        f"{met} of {len(found)} published activation energies are met. I is the state that hits the stops "
        f"({STATES['I']}), N the one that runs clear ({STATES['N']}).",
    )
    pictures = [picture for one in figures(records) for picture in _drawn(one, folder)]
    parts = [(f"{scene}, {name}", record) for scene, known in records.items() for name, record in known.items()]
    chapters = (
        Chapter("Published numbers", (Sentences(summary), verdict_table(found))),
        Chapter("Figures", tuple(pictures)),
        work_chapter(parts),
    )
    return Report("The paper, reproduced", complete, chapters)


def _drawn(one: Figure, folder: Path) -> list[Picture | Sentences]:
    """A figure for the page, and saved as a picture; a sentence where there is nothing to draw."""
    title = f"Figure {one.number}, {one.scene}. {one.caption}"
    try:
        drawn = one.draw()
        save_figure(drawn, folder / f"{one.name}.png")
        return [Picture(inline_svg(drawn, one.name), title)]
    except VibrokitError as error:
        return [Sentences((f"{title} It could not be drawn: {error}",))]


def _with_interval(one: Verdict) -> str:
    value, lower, upper = (number_text(number, ".4g") for number in (one.value, one.lower, one.upper))
    return value if math.isnan(one.value) else f"{value} ({lower} to {upper})"


def verdict_table(found: list[Verdict]) -> Table:
    """Return a row for each published number: ours beside it, the certified one, and why they differ."""
    rows = tuple(
        (
            one.published.scene, one.published.state, str(one.published.method), f"{one.published.value:.4g}",
            _with_interval(one),
            number_text(one.certified, ".6g"), str(one.match),
            one.sentence,
        )
        for one in found
    )  # fmt: skip
    header = ("scene", "state", "method", "published", "here", "certified", "verdict", "reason")
    return Table(PUBLISHED, "Activation energies (m² s⁻³)", header, rows)
