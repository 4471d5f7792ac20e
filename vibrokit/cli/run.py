"""vibrokit run: find the structure, run the analyzers, save and print what was found, whatever happens meanwhile."""

from __future__ import annotations

import argparse
import dataclasses
import sys
import traceback
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from vibrokit.analyzers.analyzer import Analyzer
from vibrokit.analyzers.settings import configured, named_exit, setting
from vibrokit.cli.json_output import print_json
from vibrokit.cli.long_work import Interrupts, check_targets, scene_stem, source_of
from vibrokit.errors import VibrokitError
from vibrokit.kernels.named import named_stepper
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.progress import checked_time_limit
from vibrokit.registry import Group, load
from vibrokit.report.data import findings_data, run_data
from vibrokit.report.text import record_text
from vibrokit.results.atomic import save_figure
from vibrokit.results.codes import Code
from vibrokit.results.finding import Finding
from vibrokit.results.record import Record
from vibrokit.results.result import Result
from vibrokit.results.stoppable import Stoppable
from vibrokit.results.structure import Structure
from vibrokit.scene_file import load_scene
from vibrokit.structure.find import find_structure

STRUCTURE = "structure"  # its name among those of the analyzers
_ENDINGS = (".png", ".pdf", ".svg", ".nc")


@dataclasses.dataclass(frozen=True)
class Plan:
    """What is asked for, checked before any work is done."""

    osc: Oscillator
    stepper: Stepper | None
    analyzers: Mapping[str, Analyzer]


@dataclasses.dataclass
class Outcome:
    """What was found so far, kept from the moment that it is found."""

    asked: tuple[str, ...]
    structure: Structure | None = None
    results: dict[str, Result] = dataclasses.field(default_factory=dict)
    findings: list[Finding] = dataclasses.field(default_factory=list)
    files: dict[str, Path] = dataclasses.field(default_factory=dict)
    printed: set[str] = dataclasses.field(default_factory=set)
    seconds: float = 0.0
    failed: bool = False

    @property
    def records(self) -> dict[str, Record]:
        """All that was found, by name."""
        found: dict[str, Record] = {} if self.structure is None else {STRUCTURE: self.structure}
        return found | self.results

    @property
    def complete(self) -> bool:
        """Whether all that was asked for is there."""
        return {STRUCTURE, *self.asked} == {name for name, record in self.records.items() if record.complete}

    @property
    def status(self) -> int:
        """Exit status of a run that was not interrupted."""
        return int(self.failed or not self.complete or any(record.failed for record in self.records.values()))


def run(options: argparse.Namespace) -> int:
    """Run the command and return its exit status."""
    outcome = Outcome(tuple(dict.fromkeys(options.analyzer)))
    with Interrupts() as interrupts:
        plan = planned(options)
        # It ends by itself, unless it is stopped before there is a structure, or Ctrl-C is pressed twice.
        with Stoppable("the search for steady states") as whole:
            _work(plan, options, interrupts, outcome, whole)
        outcome.findings += whole.findings
        _save(outcome, options)
        _print(outcome, options)
        if not (options.json or interrupts.requested):
            _draw(outcome, options)
        if interrupts.requested:
            print(f"vibrokit: interrupted; {_written(outcome)}.", file=sys.stderr)
        return interrupts.status(outcome.status)


def planned(options: argparse.Namespace) -> Plan:
    """Check what is asked for."""
    check_targets(options.output, options.checkpoint, picture=options.figure)
    if not options.seed >= 0:
        raise VibrokitError(f"--seed must be a whole number, at least 0, got {options.seed}.")
    if not 2 <= options.cells <= 20_000:
        raise VibrokitError(f"--cells must be a whole number from 2 to 20000, got {options.cells}.")
    checked_time_limit(options.time_limit)
    osc = load_scene(options.scene)
    stepper = None if options.stepper is None else named_stepper(options.stepper)
    settings: dict[str, Any] = dict(setting(text) for text in options.set)
    settings |= {} if stepper is None else {"stepper": stepper}
    settings |= {} if options.exit is None else {"exit": named_exit(options.exit)}
    settings |= {} if options.source is None else {"source": source_of(options.source)}
    kinds = {name: load(Group.ANALYZERS, name, Analyzer) for name in options.analyzer}
    if options.checkpoint is not None:
        keeping = [name for name, kind in kinds.items() if kind.keeps_checkpoints]
        if len(keeping) != 1:
            raise VibrokitError(
                f"--checkpoint is for one analyzer that writes checkpoints, such as mfet; {len(keeping)} of "
                f"{', '.join(kinds) or 'none'} do; choose one with --analyzer."
            )
    analyzers = {name: configured(kind, settings) for name, kind in kinds.items()}
    for name, analyzer in analyzers.items():
        try:
            analyzer.check(osc)
        except VibrokitError as error:
            raise VibrokitError(f"{name} cannot be run: {error}") from error
    return Plan(osc, stepper, analyzers)


def _work(plan: Plan, options: argparse.Namespace, interrupts: Interrupts, outcome: Outcome, whole: Stoppable) -> None:
    """Find the structure and run the analyzers; keep each of them in the outcome as soon as it is there."""

    def not_run(name: str, reason: str) -> None:
        outcome.findings.append(Finding.of(Code.ANALYZER_NOT_RUN, analyzer=name, reason=reason))

    with interrupts.working(options.time_limit) as work:
        try:
            cells = (options.cells, options.cells)
            outcome.structure = find_structure(plan.osc, cells=cells, stepper=plan.stepper, rng=options.seed)
            whole.doing = "the analysis"
            _print_records(outcome, options)
            for name, analyzer in plan.analyzers.items():
                if interrupts.requested or not all(record.complete for record in outcome.records.values()):
                    not_run(name, "the work was stopped before.")
                    continue
                try:
                    kept = options.checkpoint if analyzer.keeps_checkpoints else None
                    outcome.results[name] = analyzer.run(plan.osc, outcome.structure, checkpoint=kept)
                except VibrokitError as error:
                    not_run(name, str(error))
                except Exception as error:  # of a plug-in, or a mistake of ours: what was found is kept
                    traceback.print_exc()
                    not_run(name, f"{type(error).__name__}: {error}")
                else:
                    _save_results(outcome, options)
                    _print_records(outcome, options)
        finally:
            outcome.seconds = work.seconds


def _save_results(outcome: Outcome, options: argparse.Namespace) -> list[str]:
    """Write the results that were not written yet, if a file was asked for; return the names of all with a content."""
    names = [name for name, one in outcome.results.items() if one.complete or one.energies or one.data]
    for name in names:
        if options.output is not None and name not in outcome.files:
            _write(outcome, name, _numbered(options.output, name, len(outcome.asked)))
    return names


def _save(outcome: Outcome, options: argparse.Namespace) -> None:
    """Write what was not written yet; the structure too if no analyzer has a result, or if something is missing."""
    results = _save_results(outcome, options)
    if options.output is not None and outcome.structure is not None and not (results and outcome.complete):
        _write(outcome, STRUCTURE, _numbered(options.output, STRUCTURE, 1 + len(results)))


def _write(outcome: Outcome, name: str, path: Path) -> None:
    try:
        outcome.records[name].save(path)
    except (VibrokitError, OSError) as error:
        outcome.failed = True
        print(f"vibrokit: {path} was not written: {error}", file=sys.stderr)
    else:
        outcome.files[name] = path


def _print_records(outcome: Outcome, options: argparse.Namespace) -> None:
    """Print as text what was not printed yet; JSON is one object, printed at the end."""
    for name, record in outcome.records.items():
        if not options.json and name not in outcome.printed:
            text = record_text(f"{options.scene}: {name}", record, brief=not options.verbose)
            print(text, end="\n\n", flush=True)
            outcome.printed.add(name)


def _print(outcome: Outcome, options: argparse.Namespace) -> None:
    """Print what was not printed yet, or one JSON object; what was not run goes to standard error too."""
    for finding in outcome.findings:
        print(f"vibrokit: {finding}", file=sys.stderr)
    if options.json:
        found = {"scene": options.scene, "complete": outcome.complete, **run_data(outcome.structure, outcome.results)}
        found["findings"] += findings_data("run", outcome.findings)
        files = {name: str(path) for name, path in outcome.files.items()}
        print_json(**found, files=files, seed=options.seed, seconds=outcome.seconds)
    else:
        _print_records(outcome, options)
        print(f"{outcome.seconds:.1f} s; {_written(outcome)}.")
    sys.stdout.flush()


def _draw(outcome: Outcome, options: argparse.Namespace) -> None:
    """Save a figure of each result; of the structure if no analyzer was asked for."""
    records = outcome.results if outcome.asked else outcome.records
    for name, record in records.items():
        path = options.figure or Path(f"{scene_stem(options.scene)}.png")
        path = _numbered(path, name, len(outcome.asked or records) if options.figure else 2)
        try:
            save_figure(record.plot(), path)
        except (VibrokitError, OSError) as error:
            outcome.failed = True
            print(f"vibrokit: {path} was not drawn: {error}", file=sys.stderr)
        else:
            print(f"figure: {path}")


def _written(outcome: Outcome) -> str:
    files = ", ".join(f"{path} ({name})" for name, path in outcome.files.items())
    return f"written: {files}" if files else "no result was saved; -o FILE saves them"


def _numbered(path: Path, name: str, count: int) -> Path:
    """Return the path of one of several files."""
    ending = path.suffix if path.suffix in _ENDINGS else ""
    return path if count == 1 else path.with_name(f"{path.name.removesuffix(ending)}-{name}{ending}")
