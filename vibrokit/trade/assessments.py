"""Work and precision of assessments on one scene: the accuracy that was reached against computing time."""

from __future__ import annotations

import dataclasses
import math
import time
from collections.abc import Sequence

from vibrokit.assessment.assess import METHODS, assess
from vibrokit.assessment.assessment import Assessment
from vibrokit.errors import StructureError
from vibrokit.oscillator import Oscillator
from vibrokit.progress import Progress, advance, stage, working
from vibrokit.results.structure import Structure
from vibrokit.structure.find import find_structure
from vibrokit.text_table import number_text, text_table

ACCURACIES = (0.3, 0.1, 0.03)
"""What is asked for."""
_HEADINGS = ("accuracy", "of ΔU", *(f"of times, {name}" for name in METHODS[1:]), "CPU time (s)", "wall time (s)")


@dataclasses.dataclass(frozen=True)
class AssessmentRow:
    """One accuracy; the steady states are known before, and their time does not count."""

    accuracy: float
    energies: float  # largest half-width of the bounds of ΔU of the cheapest exits, relative; NaN if one is not known
    times: dict[str, float]  # by method: median half-width of the intervals of ln τ
    cpu_seconds: float  # of all threads
    seconds: float
    complete: bool


@dataclasses.dataclass(frozen=True)
class AssessmentTrade:
    """Work and precision of `assess` with all methods."""

    rows: tuple[AssessmentRow, ...]

    def __str__(self) -> str:
        lines = [_HEADINGS]
        for row in self.rows:
            reached = (number_text(row.times.get(name, math.nan), ".2g") for name in METHODS[1:])
            numbers = number_text(row.cpu_seconds, ".0f"), number_text(row.seconds, ".0f")
            lines.append((f"{row.accuracy:g}", number_text(row.energies, ".2g"), *reached, *numbers))
        return "\n".join(
            ["Assessments: the accuracy that was reached, as half-widths of intervals.", "", *text_table(lines)]
        )


def measure_assessments(
    osc: Oscillator,
    structure: Structure | None = None,
    *,
    source: int | str | None = None,
    accuracies: Sequence[float] = ACCURACIES,
    progress: Progress = None,
) -> AssessmentTrade:
    """Measure reached accuracy and time of `assess` without a time limit, for `source` or for all states.

    SceneError is raised if the scene has no noise, StructureError if there is nothing to leave.
    """
    with working(progress):
        found = structure or find_structure(osc, rng=0)
        rows = []
        with stage("assessments", unit="accuracies", total=len(accuracies)):
            for accuracy in sorted(accuracies)[::-1]:
                cpu, wall = time.process_time(), time.perf_counter()
                one = assess(osc, accuracy=accuracy, time_limit=None, source=source, known=[found])
                spent = time.process_time() - cpu, time.perf_counter() - wall
                rows.append(AssessmentRow(accuracy, _of_energies(one), _of_times(one), *spent, one.complete))
                advance()
    return AssessmentTrade(tuple(rows))


def _of_energies(one: Assessment) -> float:
    sources = {energy.source for result in one.results.values() for energy in result.energies}
    known = []
    for source in sources:
        try:
            known.append(one.energy(source))
        except StructureError:
            return math.nan
    return max(((e.upper - e.lower) / (2.0 * e.value) for e in known if e.value > 0), default=math.nan)


def _of_times(one: Assessment) -> dict[str, float]:
    found = {}
    for name, result in one.results.items():
        halves = sorted((rate.log_upper - rate.log_lower) / 2.0 for rate in result.rates)
        if halves:
            found[name] = halves[len(halves) // 2]
    return found
