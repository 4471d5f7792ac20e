"""The work of the reproduction: steps that have a file are read, the others are done and kept."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from vibrokit.analyzers.settings import settings_of
from vibrokit.errors import VibrokitError
from vibrokit.oscillator import Oscillator
from vibrokit.progress import advance, stage
from vibrokit.reproduction.steps import Step
from vibrokit.results.atomic import checked_target
from vibrokit.results.files import load_result
from vibrokit.results.record import Record, versions
from vibrokit.results.stoppable import Stoppable
from vibrokit.results.structure import Structure
from vibrokit.scene_file import load_scene, scene_data
from vibrokit.structure.find import find_structure

Records = dict[str, dict[str, Record]]
"""By scene and by the name of the step."""


def do(steps: Sequence[Step], folder: Path) -> Records:
    """Do the steps that have no complete record in a folder, and return the records of all that were reached.

    A record is written whole or not at all, and read again, so that work which was stopped at any moment goes on with
    the same bits: all arrays, energies and findings are those of work that was not stopped. Only times and the counts
    of seconds differ. An interrupt or a time limit ends the work; the step under way is done again the next time.

    Raises
    ------
    FileError
        A file cannot be written; this is found before any work.
    """
    found: Records = {}
    files = [checked_target(folder / step.file) for step in steps]
    with Stoppable("steps"), stage("steps", unit="steps", total=len(steps)):
        for step, file in zip(steps, files, strict=True):
            osc, own = load_scene(step.scene), found.setdefault(step.scene, {})
            record = _kept(file, step, osc)
            if record is None:
                with stage(step.name, subject=step.scene, unit="step", total=1):
                    made = _made(step, osc, own)
                    if not made.complete:
                        break
                    made.save(file)
                    advance()
                record = load_result(file)
            own[step.name] = record
            advance()
    return found


def _kept(file: Path, step: Step, osc: Oscillator) -> Record | None:
    """What a step made before; None if its file is missing or damaged, or of another scene, other settings or versions.

    All these are done again: the file of a step is the work's own.
    """
    try:
        record: Record = load_result(file)
    except VibrokitError:
        return None
    if step.analyzer is None:
        same = isinstance(record, Structure) and record.settings["cells"] == (step.cells and list(step.cells))
    else:
        same = record.settings == settings_of(step.analyzer)
    same = same and (record.scene, record.versions) == (scene_data(osc), versions())
    return record if record.complete and same else None


def _made(step: Step, osc: Oscillator, before: dict[str, Record]) -> Record:
    if step.analyzer is None:
        return find_structure(osc, cells=step.cells)
    structure = before["structure"]
    assert isinstance(structure, Structure)  # the first step of a scene
    return step.analyzer.run(osc, structure)
