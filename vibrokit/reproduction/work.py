"""The work of the reproduction: steps that have a file are read, the others are done and kept."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from vibrokit.analyzers.settings import settings_of
from vibrokit.errors import VibrokitError
from vibrokit.progress import advance, stage
from vibrokit.reproduction.steps import Step
from vibrokit.results.files import load_result
from vibrokit.results.record import Record
from vibrokit.results.stoppable import Stoppable
from vibrokit.results.structure import Structure
from vibrokit.scene_file import load_scene
from vibrokit.structure.find import find_structure

Records = dict[str, dict[str, Record]]
"""By scene and by the name of the step."""


def do(steps: Sequence[Step], folder: Path) -> Records:
    """Do the steps that have no complete record in a folder, and return the records of all that were reached.

    A record is written whole or not at all, and read again, so that work which was stopped goes on with the same bits.
    An interrupt or a time limit ends the work; the step under way is done again the next time.
    """
    found: Records = {}
    with Stoppable("steps"), stage("steps", unit="steps", total=len(steps)):
        for step in steps:
            own = found.setdefault(step.scene, {})
            record = _kept(folder / step.file, step)
            if record is None:
                made = _made(step, own)
                if not made.complete:
                    break
                made.save(folder / step.file)
                record = load_result(folder / step.file)
            own[step.name] = record
            advance()
    return found


def _kept(path: Path, step: Step) -> Record | None:
    """The record of a step in its file; None if there is none, or one with other settings."""
    if not path.exists():
        return None
    try:
        record = load_result(path)
    except VibrokitError:
        return None
    same = step.analyzer is None or record.settings == settings_of(step.analyzer)
    return record if record.complete and same else None


def _made(step: Step, before: dict[str, Record]) -> Record:
    osc = load_scene(step.scene)
    if step.analyzer is None:
        return find_structure(osc)
    structure = before["structure"]
    assert isinstance(structure, Structure)  # the first step of a scene
    return step.analyzer.run(osc, structure)
