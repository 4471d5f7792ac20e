"""Records as text: tables of their numbers, their findings as sentences, and how much work they took."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from functools import singledispatch

from vibrokit.comparison.reconciliation import Reconciliation
from vibrokit.comparison.tables import overview_text, quantity_rows, verdict_rows
from vibrokit.comparison.transitions import Transitions
from vibrokit.report.blocks import Block, Listing, Sentences, Table
from vibrokit.report.tables import (
    along_table,
    attractor_table,
    coexistence_table,
    energy_table,
    gap_table,
    noise_intensity,
    rate_table,
    saddle_table,
    sensitivity_table,
)
from vibrokit.results.codes import Severity
from vibrokit.results.files import PlainRecord
from vibrokit.results.finding import Finding, together
from vibrokit.results.record import Record
from vibrokit.results.result import Result
from vibrokit.results.structure import Structure
from vibrokit.results.sweep import Sweep


def record_text(title: str, record: Record, *, brief: bool = False) -> str:
    """Return what a record says: tables, findings, and one line on the work it took.

    A brief text has no tables of detail, and of the findings only warnings and errors.
    """
    heading = title if record.complete else f"{title} (incomplete)"
    texts = (block.text for block in blocks_of(record) if not (brief and block.detail))
    findings = record.serious if brief else record.findings
    work = f"{record.seconds:.1f} s." if brief else stats_text(record)
    sections = [heading, *texts, findings_text(findings, record.names), work]
    return "\n\n".join(section for section in sections if section)


@singledispatch
def blocks_of(record: Record) -> list[Block]:
    """Return the numbers of a record; one of another kind has its findings only."""
    return []


@blocks_of.register
def _plain_blocks(record: PlainRecord) -> list[Block]:
    return [energy_table(record, record.energies)] if record.energies else []


@blocks_of.register
def _reconciliation_blocks(reconciliation: Reconciliation) -> list[Block]:
    verdicts = Table("verdicts", "Verdicts", ("about", "verdict", "reason"), tuple(verdict_rows(reconciliation)))
    numbers = [
        Table(f"numbers-{index}", title, rows[0], tuple(rows[1:]))
        for index, (title, rows) in enumerate(quantity_rows(reconciliation))
    ]
    return [Sentences(tuple(overview_text(reconciliation).splitlines())), verdicts, *numbers]


@blocks_of.register
def _sweep_blocks(sweep: Sweep) -> list[Block]:
    return [coexistence_table(sweep), gap_table(sweep), along_table(sweep)]


@blocks_of.register
def _structure_blocks(structure: Structure) -> list[Block]:
    if not structure.attractors:
        return [Sentences(("No steady state was found.",))]
    return [attractor_table(structure), dataclasses.replace(saddle_table(structure), detail=True)]


@blocks_of.register
def _result_blocks(result: Result) -> list[Block]:
    if not result.energies and not result.rates:
        return [Sentences(("No activation energy was found.",))]
    found: list[Block] = [energy_table(result, result.energies)]
    if len(result.branches) > len(result.energies):
        ranked = sorted(result.branches, key=lambda branch: (branch.source, branch.target, branch.value))
        title = "All paths, the cheapest of each exit first"
        found.append(dataclasses.replace(energy_table(result, ranked), name="paths", title=title, detail=True))
    found += [dataclasses.replace(sensitivity_table(result), detail=True), rate_table(result)]
    return [*found, *_transitions(result)] if any(energy.target >= 0 for energy in result.energies) else found


def _transitions(result: Result) -> list[Block]:
    """Energies between all attractors with what follows from them, if enough of them are known."""
    transitions, intensity = Transitions.of(result), noise_intensity(result)
    if not transitions.known:
        return []
    weights = [str(transitions.stationary_weights(intensity))] if intensity > 0 else []
    return [Listing("Transitions", "\n".join([str(transitions), *weights]), detail=True)]


def findings_text(findings: Sequence[Finding], names: Sequence[str] = ()) -> str:
    """Return the findings as sentences, each once: errors and warnings with advice, then information."""
    lines, shown = [], together(findings)
    for severity in (Severity.ERROR, Severity.WARNING, Severity.INFO):
        for finding in (one for one in shown if one.severity is severity):
            advice = "" if severity is Severity.INFO else f" {finding.advice}"
            lines.append(f"{severity}: {finding.sentence(names)}{advice}".rstrip())
    return "\n".join(lines)


def stats_text(record: Record) -> str:
    """Return how much work a record took, in one line; stages of less than a hundredth of the time are left out."""
    stats = record.stats
    done = {
        "trajectories": stats.trajectories, "section intervals": stats.intervals, "steps": stats.steps,
        "Newton iterations": stats.newton_iterations,
    }  # fmt: skip
    counts = ", ".join(f"{number:,} {name}" for name, number in done.items() if number)
    stages = sorted(stats.seconds.items(), key=lambda item: -item[1])
    times = ", ".join(f"{name} {spent:.1f} s" for name, spent in stages if spent >= 0.01 * record.seconds)
    return f"{record.seconds:.1f} s" + (f" ({times})" if times else "") + (f"; {counts}" if counts else "") + "."
