"""The steps of the reproduction: each makes one record from those before it, and is kept in a file."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from vibrokit.analyzers.action_plot import ActionPlot
from vibrokit.analyzers.analyzer import Analyzer
from vibrokit.analyzers.exits import LeaveBasin
from vibrokit.analyzers.least_action import LeastAction
from vibrokit.analyzers.mean_exit_times import MFET
from vibrokit.analyzers.settings import settings_of
from vibrokit.analyzers.sgcm_wkb import SGCM
from vibrokit.analyzers.shooting.shooting import Shooting
from vibrokit.errors import VibrokitError
from vibrokit.oscillator import Oscillator
from vibrokit.progress import advance, stage
from vibrokit.reproduction.published import STATES, paper, scenes, target_of
from vibrokit.results.atomic import checked_target
from vibrokit.results.files import load_result
from vibrokit.results.record import Record, versions
from vibrokit.results.stoppable import Stoppable
from vibrokit.results.structure import Structure
from vibrokit.scene_file import load_scene, scene_data
from vibrokit.structure.find import find_structure

Records = dict[str, dict[str, Record]]
"""By scene and by the name of the step."""
METHODS = ("least-action", "ring", "density", "exit-times")
"""What each state is left by; the names of the steps are these with the state."""

_ESCAPES = 100  # realizations that are kept for Figure 10
# Computing time on two processors, at ω = 0.525: 13 s, and 75 s with the default of 200², which is doubled since the
# state that hits lies in a cell of another basin. Of grids from 60² to 200² that is so for every other one.
_FEW_CELLS = (128, 128)


@dataclasses.dataclass(frozen=True)
class Step:
    """One piece of work: the structure of a scene, or an analyzer on it."""

    scene: str
    name: str  # unique in its scene
    analyzer: Analyzer | None = None  # None for the structure
    cells: tuple[int, int] | None = None  # of the basins of a structure

    @property
    def file(self) -> str:
        """Name of the file that keeps its record."""
        return f"{self.scene}-{self.name}.nc"


def steps(*, quick: bool) -> tuple[Step, ...]:
    """Return all steps, a structure before what needs it. Quick ones search less, and have fewer nodes and exits."""
    found = list[Step]()
    for scene in scenes():
        found.append(Step(scene, "structure", cells=_FEW_CELLS if quick else None))
        for state in STATES:
            methods = zip(METHODS, _methods(scene, state, quick=quick), strict=True)
            found += [Step(scene, f"{name}-{state}", analyzer) for name, analyzer in methods]
    return tuple(found)


def _methods(scene: str, state: str, *, quick: bool) -> tuple[Analyzer, ...]:
    """What answers how a state is left, in the order of `METHODS`."""
    given = paper()
    left: dict[str, Any] = {"source": STATES[state], "exit": LeaveBasin(to=target_of(state))}
    density, error = given["density"]["intensity"], 0.3 if quick else 0.1
    simulated = tuple(given["intensities"][scene][state])
    return (
        LeastAction(**left, accuracy=error, shooting=None if quick else Shooting()),
        ActionPlot(**left, radius=given["ring"]["radius"], points=10_000 if quick else given["ring"]["points"]),
        SGCM(**left, intensities=(density,), accuracy=0.5 if quick else 0.1),
        MFET(**left, intensities=simulated, target_error=error, escapes=_ESCAPES),
    )


def do(wanted: Sequence[Step], folder: Path) -> Records:
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
    files = [checked_target(folder / step.file) for step in wanted]
    with Stoppable("steps"), stage("steps", unit="steps", total=len(wanted)):
        for step, file in zip(wanted, files, strict=True):
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
