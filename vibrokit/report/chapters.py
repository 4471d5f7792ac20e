"""The chapters of a report: the answer, the scene, the evidence of each method, what limits it, how it was computed."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence

from vibrokit.assessment.assessment import STRUCTURE, Assessment
from vibrokit.assessment.plausibility import Plausibility, plausibility
from vibrokit.errors import StructureError, VibrokitError
from vibrokit.oscillator import Oscillator
from vibrokit.report.answer import answer_sentences
from vibrokit.report.assessment import states_blocks
from vibrokit.report.blocks import Block, Chapter, Formulas, Listing, Sentences, Table
from vibrokit.report.pictures import pictures_of, scene_picture
from vibrokit.report.tables import input_table
from vibrokit.report.text import blocks_of, findings_text, stats_text
from vibrokit.results.record import Record
from vibrokit.scene_file import scene_text

Named = tuple[str, Record]


def chapters_of(records: Sequence[Record]) -> tuple[Chapter, ...]:
    """Return the chapters of records of one scene.

    Raises
    ------
    VibrokitError
        A part of the scene is not installed.
    """
    osc = records[0].oscillator
    parts = [part for record in records for part in _parts(record)]
    answers = [chapter for record in records if isinstance(record, Assessment) for chapter in _answers(record)]
    evidence = [
        Chapter(_heading(name), (*blocks_of(part), *pictures_of(part, f"r{number}")))
        for number, (name, part) in enumerate(parts)
    ]
    own = [(record.kind, record) for record in records if isinstance(record, Assessment)]
    made = _limits([*parts, *own]), work_chapter([*parts, *own], _scene_file(osc))
    found = [*answers, _scene(osc), *evidence, *_agreement(records), *made]
    return tuple(chapter for chapter in found if chapter.blocks)


def _parts(record: Record) -> list[Named]:
    """The records that have numbers of their own, by name."""
    if isinstance(record, Assessment):
        return [(STRUCTURE, record.structure), *record.results.items()]
    return [(record.made_by, record)]


def _heading(name: str) -> str:
    return "Steady states" if name == STRUCTURE else f"By {name}"


def _answers(one: Assessment) -> Iterator[Chapter]:
    yield Chapter("Answer", (Sentences(answer_sentences(one)),))
    yield Chapter("How long each state lasts", (*states_blocks(one), *pictures_of(one, "times")))


def _scene(osc: Oscillator) -> Chapter:
    checked = plausibility(osc)
    oddities = (Sentences(tuple(map(str, checked.oddities)), listed=True),) if checked.oddities else ()
    told = Sentences(("Equations of the most probable paths, on which p₂ stands for the noise:",))
    blocks = (scene_picture(osc), input_table(osc), told, Formulas(osc.model.mathml), _closed_forms(checked), *oddities)
    return Chapter("Scene", blocks)


def _closed_forms(checked: Plausibility) -> Table:
    rows = tuple((row.heading, f"{row.value:.4g}", row.measure.unit or "1") for row in checked.rows)
    return Table(
        "closed-forms", "What formulas say of the scene, before any search", ("quantity", "value", "unit"), rows
    )


def _agreement(records: Iterable[Record]) -> Iterator[Chapter]:
    for one in records:
        if isinstance(one, Assessment):
            try:
                yield Chapter("Agreement of the methods", tuple(blocks_of(one.reconciliation)))
            except StructureError:  # there is nothing to compare; the answer says so
                continue


def _limits(parts: Sequence[Named]) -> Chapter:
    """The warnings and errors of all parts."""
    blocks: list[Sentences] = []
    for name, part in parts:
        lines = tuple(findings_text(part.serious, part.names).splitlines())
        if lines:
            blocks += [Sentences((f"{name}:",)), Sentences(lines, listed=True)]
    return Chapter("What limits the numbers", tuple(blocks))


def work_chapter(parts: Sequence[Named], *more: Block) -> Chapter:
    """Return how records were computed: work, versions, settings and remarks of each, and more."""
    rows = [
        (name, "yes" if part.complete else "no", "–" if part.seed is None else str(part.seed), stats_text(part))
        for name, part in parts
    ]
    versions = dict.fromkeys(pair for _, part in parts for pair in part.versions.items())
    blocks: list[Block] = [
        Table("work", "Work", ("part", "complete", "seed", "time"), tuple(rows)),
        Sentences((f"Computed with {', '.join(' '.join(pair) for pair in versions)}.",)),
    ]
    for name, part in parts:
        remarks = [one for one in part.findings if one not in part.serious]
        blocks.append(Listing(f"Settings of {name}", _settings_text(part)))
        if remarks:
            blocks.append(Listing(f"Remarks of {name}", findings_text(remarks, part.names)))
    return Chapter("How it was computed", (*blocks, *more))


def _scene_file(osc: Oscillator) -> Block:
    try:
        return Listing("Scene file, to repeat it", scene_text(osc))
    except VibrokitError as error:
        return Sentences((f"The scene cannot be written to a file: {error}",))


def _settings_text(record: Record) -> str:
    """A line for each setting, as JSON."""
    return "\n".join(f"{name} = {json.dumps(value, default=str)}" for name, value in record.settings.items())
